"""Boids as robots: what they measure and hear, how they follow the velocity that their
model wants, which of them fail, and the wind that carries them.

robots      what all layers share
purposes    what their random numbers are for
senses      what a flight keeps of what its boids know
sensing     what a boid knows of others and of itself
hearing     of whom it hears
occlusion   what hides others from it
breakdowns  which boids fail, when and how
motors      what limits the motors of each boid
actuation   how a boid follows the velocity that its model wants
spreads     parameters of a model that differ from robot to robot
differing   which of them a robot has
readers     which of them its model reads robot by robot
abilities   what the robots of a model can do
wind        how the medium moves that carries all boids
"""
