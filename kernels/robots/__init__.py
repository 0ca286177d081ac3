"""Boids as robots: what they measure and hear, how they follow the velocity that their
model wants, and which of them fail.

robots      what all layers share
breakdowns  which boids fail, when and how
motors      what limits the motors of each boid
actuation   how a boid follows the velocity that its model wants
"""
