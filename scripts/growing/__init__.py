"""What a check costs as a file grows: documents of every kind of content, and clocks for them."""
