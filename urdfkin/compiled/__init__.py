"""The textbook's recursion (sections 7.4 and 7.7), written once.

Either Python interprets this recursion, or Numba compiles it.
"""
