"""The textbook's forward recursion (sections 7.4 and 7.7).

Python interprets the code of this recursion, or Numba compiles the same code.
"""
