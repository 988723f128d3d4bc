"""Trajectories of joints, and the motion of a frame along a trajectory."""
