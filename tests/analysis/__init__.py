"""Estimates, intervals and contrasts of values whose answer is known."""
