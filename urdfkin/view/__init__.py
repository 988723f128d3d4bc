"""The viewer in a browser tab (the extra `urdfkin[view]`): a robot that moves, its numbers checked live."""
