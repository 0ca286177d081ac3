"""Trials in worker processes, here or on a cluster: none lost, none twice."""
