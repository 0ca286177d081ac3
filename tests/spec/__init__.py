"""Specs that are read, and mistakes that are told."""
