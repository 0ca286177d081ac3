"""Purposes of the random numbers of robots.

A purpose is the last part of the address of a random number, see kernels.chance. Each
kind of random number has a separate purpose.
"""

LOSS, SENT_ERROR, OWN_ERROR = 100, 101, 102
"""Purposes of communication and sensing, with the addresses of the random numbers.

LOSS, the loss of a packet: (step of the sample, receiver, sender).

SENT_ERROR, errors of measurement in messages: (step, boid, axis).

OWN_ERROR, errors in the knowledge of a boid about itself: (step, boid, axis).
"""
FAILS, FACTOR, PUSH, PARAMETER, WAY = 200, 201, 202, 203, 204
"""Purposes of failures, actuation and motion, with the addresses of the random numbers.

FAILS, the failure of a boid: (boid, 0, 0).

FACTOR, factors of the actuators of a boid: (boid, number, 0).

PUSH, noise of the actuators of a boid: (step, boid, 0).

PARAMETER, factors of the parameters of a boid: (boid, number of the parameter, 0).

WAY, the direction in which an obstacle moves: (obstacle, 0, 0).
"""
FIRST_GUST, GUST = 300, 301
"""Purposes of wind, with the addresses of the random numbers.

FIRST_GUST, the first gust of a trial: (0, 0, 0).

GUST, the change of the gust in a step: (step, 0, 0).
"""
