"""Programs that run the exported code of Denavit-Hartenberg tables."""
