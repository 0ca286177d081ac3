"""What a stranger may give us, and what comes of it."""
