"""The page, as a protocol and in a real browser."""
