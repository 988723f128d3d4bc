"""The text's recursion, sections 7.4 and 7.7, once, compiled, for whole batches."""
