"""The textbook's recursion (sections 7.4 and 7.7), written once.

Python can interpret it or Numba compile it.
"""
