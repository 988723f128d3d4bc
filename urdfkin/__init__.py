"""Textbook kinematics from any URDF, every number checked against Pinocchio."""
