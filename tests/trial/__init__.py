"""One trial: its bits, and how it stops and goes on."""
