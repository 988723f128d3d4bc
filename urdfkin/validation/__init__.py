"""Validation: many samples, every frame and every joint, held against Pinocchio."""
