"""Validation: many samples, every quantity, every frame, every joint, held against Pinocchio."""
