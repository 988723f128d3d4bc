"""Validate a robot: compare every frame and every joint with Pinocchio on many samples."""
