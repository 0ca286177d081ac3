"""Steering rules, one kernel each: from what a boid perceives to a vector.

social      separation laws, alignment, cohesion        steering    wander
obstacles   repulsion by obstacles and walls            borders     what happens at the edge of the world
"""
