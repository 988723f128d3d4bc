"""Reference values: the same quantities with fifty digits, or with intervals that contain the true value."""
