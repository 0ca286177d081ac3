"""Boids as robots: sensing, communication, actuation, failures, and wind.

robots      layers between a model and its boids
purposes    addresses of their random numbers
senses      state of the senses of a flock
sensing     what a boid knows of others and of itself
hearing     boids of which a boid hears
occlusion   obstacles and bodies that hide boids
breakdowns  failures of boids
motors      limits of the motors of each boid
actuation   how a boid follows the velocity that its model commands
spreads     parameters of a model that differ from robot to robot
differing   parameters of one robot
readers     parameters that a model reads robot by robot
abilities   what the robots of a model can do
wind        motion of the medium that carries all boids
"""
