"""Calibrate a robot from measured poses, and write the result back into its own file."""

from __future__ import annotations
