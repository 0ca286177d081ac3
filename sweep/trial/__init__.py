"""From a job to its Result: the one door to the kernels.

simulation  a flight of the kernels, call by call
scenery     the world and its obstacles, drawn from the job
derived     metrics that a spec computes from others
state       what is between two calls
result      what a trial gave
generators  random numbers for kernels
kinds       how many boids are of which kind
world       the same world, to be shown
looking     what boids see and rules do, to be shown
compiled    where kernels are kept
probe       a few short trials, of code whose cost is not known
numba_errors  why a kernel cannot be compiled, as a sentence
interrupts  how a run is told to stop
"""
