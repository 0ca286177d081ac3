"""Stored studies: whole or absent, here and in object stores."""
