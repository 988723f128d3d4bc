"""Parts of scripts/mutate.py: the mutants, their injection into a process, and the selection of tests."""
