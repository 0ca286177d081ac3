"""Boids as robots: what they measure and hear, how they follow the velocity that their
model wants, and which of them fail.

robots  what all layers share
"""
