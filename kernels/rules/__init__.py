"""Steering rules, one kernel per rule: from the perception of a boid to a vector.

social     separation laws, alignment, cohesion
steering   wander, the way to a goal
headings   the average heading, with noise
obstacles  repulsion by obstacles and walls
borders    effects of the borders of the world
avoidance  steering around occupied cells of a grid
"""
