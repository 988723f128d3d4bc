"""Reference values: numbers with fifty digits, or intervals around true values."""
