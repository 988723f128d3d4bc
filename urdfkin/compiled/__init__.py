"""The textbook's forward recursion (sections 7.4 and 7.7).

Python can interpret the recursion's code, and Numba can compile the same code.
"""
