"""The textbook's recursion (sections 7.4 and 7.7), written once and used interpreted as well as compiled."""
