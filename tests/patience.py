"""How long tests wait for what must happen."""

PATIENCE = 600.0
"""Seconds after which a test gives up. No machine that works reaches them, whatever
else it does; only what would never happen does.
"""
