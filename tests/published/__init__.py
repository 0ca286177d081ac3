"""Claims, measures and verdicts."""
