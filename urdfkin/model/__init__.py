"""What a robot is: links, joints, coordinates, frames, a base that may move."""
