"""Stored trials again, as bits and as films."""
