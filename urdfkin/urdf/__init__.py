"""URDF text to `KinematicTree` and back."""
