"""Points, jobs, and what they cost."""
