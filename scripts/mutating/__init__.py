"""Parts of scripts/mutate.py: what a slip looks like, how a process gets one, which tests would see it."""
