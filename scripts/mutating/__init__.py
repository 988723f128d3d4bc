"""Parts of scripts/mutate.py: the mutants, and their injection into a process."""
