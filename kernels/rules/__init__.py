"""Steering rules, one kernel each: from what a boid perceives to a vector.

social     separation laws, alignment, cohesion
steering   wander, the way to a goal
headings   the average heading, its noise
obstacles  repulsion by obstacles and walls
borders    effects of the edge of the world
avoidance  steering around occupied cells of a grid
"""
