"""The robot model: links, joints, coordinates, frames and the motion of the base."""
