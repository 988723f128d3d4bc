"""Motions in time, and all that can be told of a frame along one."""
