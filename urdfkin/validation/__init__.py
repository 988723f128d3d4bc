"""Validation: comparison of every frame and every joint with Pinocchio, on many samples."""
