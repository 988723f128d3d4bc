"""The alignment of two mechanisms, and bounds on their difference, for `same` and `dh --compare`."""
