"""Alignment and difference bounds of two mechanisms, for `same` and `dh --compare`."""
