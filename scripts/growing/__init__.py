"""Measure the cost of a check as a file grows: documents of many kinds, and their measurement."""
