"""Measures of the built-in studies."""
