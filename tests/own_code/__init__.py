"""Models and other entries from files of the user's own."""
