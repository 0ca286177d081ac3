"""Launches and searches, from the first trial to the last."""
