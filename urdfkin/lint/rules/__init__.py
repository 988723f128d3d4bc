"""The rules, one topic a file: what is looked for, and beside it the page that explains each code."""
