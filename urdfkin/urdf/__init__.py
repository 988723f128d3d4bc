"""Read robot descriptions (URDF, xacro, MJCF) as a `KinematicTree`, and write a tree as URDF."""
