"""What figures show, number by number."""
