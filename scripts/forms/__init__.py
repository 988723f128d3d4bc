"""Running the forms that tables are written in."""
