"""Purposes of the random numbers of robots.

A purpose is the last part of the address of a random number, see kernels.chance. Each
kind of number has a purpose of its own.
"""

LOSS, SENT_ERROR, OWN_ERROR = 100, 101, 102
"""Loss of a packet, with the address (step of the sample, hearer, speaker); errors of
measurement that others see, and errors of what a boid knows of itself, with (step,
boid, axis).
"""
FAILS, FACTOR, PUSH, PARAMETER, WAY = 200, 201, 202, 203, 204
"""Failure of a boid, with the address (boid, 0, 0); factors of its motors, with (boid,
number, 0); noise of its motors, with (step, boid, 0); factors of the parameters of its
model, with (boid, number of the parameter, 0); and the direction in which an obstacle
moves, with (obstacle, 0, 0).
"""
FIRST_GUST, GUST = 300, 301
"""First gust of a trial, with the address (0, 0, 0); what a step adds to the gust, with
(step, 0, 0).
"""
