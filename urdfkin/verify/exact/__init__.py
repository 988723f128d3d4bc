"""The same quantities on numbers that leave no doubt: fifty digits, or intervals that hold the true value."""
