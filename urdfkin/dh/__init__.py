"""Denavit-Hartenberg tables from any chain, exact, canonical and proven."""
