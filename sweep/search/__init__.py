"""Searches for good settings: candidates are asked of a sampler, raced against each other, and judged on new seeds.

A candidate is a setting of the parameters, a scenario one point of what it must be good at together, and a block one
replicate in every scenario. Block k has the same random numbers for every candidate.
"""
