"""What random numbers of robots are for: the last part of their addresses, see
kernels.chance. Each kind of number has one of its own.
"""

LOSS, SENT_ERROR, OWN_ERROR = 100, 101, 102
"""Whether a packet is lost, with the address (step of the sample, hearer, speaker);
errors of measurement that others see, and those of what a boid knows of itself, with
(step, boid, axis).
"""
FAILS, FACTOR, PUSH, PARAMETER, WAY = 200, 201, 202, 203, 204
"""Whether a boid fails, with the address (boid, 0, 0); the factors of its motors, with
(boid, number, 0); the noise of its motors, with (step, boid, 0); the factors of the
parameters of its model, with (boid, number of the parameter, 0); and in which direction
an obstacle moves, with (obstacle, 0, 0).
"""
FIRST_GUST, GUST = 300, 301
"""The gust with which a flight begins, with the address (0, 0, 0); what is new in that
of a step, with (step, 0, 0).
"""
