"""Programs that run tables exported as code."""
