"""Pictures of robots: the viewer in a browser tab (`urdfkin[view]`), and plots (`urdfkin[plots]`)."""
