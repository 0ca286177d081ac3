"""Steering rules, one kernel each: from what a boid perceives to a vector.

social     separation laws, alignment, cohesion
steering   wander, the way to a goal
headings   the average heading, noise of it
obstacles  repulsion by obstacles and walls
borders    what happens at the edge of the world
avoidance  steering round what an occupancy grid holds
"""
