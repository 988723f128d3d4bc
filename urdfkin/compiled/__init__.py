"""The textbook's forward recursion (sections 7.4 and 7.7), in Python and compiled with Numba."""
