"""Boids as robots: sensing, communication, actuation, failures, and wind.

robots      layers between a model and the boids
purposes    addresses of the random numbers of robots
senses      sensing model of a flock: state and parameters
sensing     knowledge of a boid about neighbours and about itself
hearing     communication: boids from which a boid receives messages
occlusion   obstacles and bodies that hide boids
breakdowns  failures of boids
motors      limits of the actuators of each boid
actuation   response of a boid to the commanded velocity
spreads     parameters of a model that differ from robot to robot
differing   parameters of one robot
readers     parameters that a model reads robot by robot
abilities   abilities of the robots of a model
wind        motion of the medium that carries all boids
"""
