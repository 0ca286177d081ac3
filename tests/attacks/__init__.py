"""What a stranger may have put into a folder, a file or a store, tried on the program as a user runs it."""
