"""Reference values: quantities computed with fifty digits, or as intervals that contain the true value."""
