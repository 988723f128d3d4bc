"""Run tables that are exported as code."""
