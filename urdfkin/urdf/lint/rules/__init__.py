"""The rules that check the records of a URDF.

A TOML file beside each module contains the pages of the module's codes.
"""
