"""Methods: reports, and what they are about."""
