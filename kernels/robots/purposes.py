"""What random numbers of robots are for: the last part of their addresses, see
kernels.chance. Each kind of number has one of its own.
"""

FAILS, FACTOR, PUSH = 200, 201, 202
"""Whether a boid fails, with the address (boid, 0, 0); the factors of its motors, with
(boid, number, 0); and the noise of its motors, with (step, boid, 0).
"""
