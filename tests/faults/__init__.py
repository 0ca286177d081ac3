"""Faults that are made and counted: kills, cuts, full disks, lost power."""
