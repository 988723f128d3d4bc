"""Attacks on urdfkin by files, names, numbers and signals; each claim of these tests failed once."""
