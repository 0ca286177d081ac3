"""Stored tables, chosen, compared and exported."""
