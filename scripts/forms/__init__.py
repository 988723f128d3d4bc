"""Programs that run Denavit-Hartenberg tables, which were exported as code."""
