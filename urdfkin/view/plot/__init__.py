"""Pictures of a frame's motion along a trajectory (the extra `urdfkin[plots]`)."""
