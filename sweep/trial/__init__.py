"""From a job to its Result: the one door to the kernels.

simulation  a flight of the kernels, call by call
lanes       trials that fly together, one in each lane
on_device   trials that fly together on a GPU
robots      whether boids are ideal ones, and which of them fail
scenery     the world and its obstacles, drawn from the job
derived     metrics that a spec computes from others
remeasuring metrics of a trial that has been flown, from its trajectory
last_flocks where boids are at the end, and begin again
state       what is between two calls
result      what a trial gave
generators  random numbers for kernels
kinds       how many boids are of which kind
world       the same world, to be shown
followed    flocks from frame to frame
looking     what boids see and rules do, to be shown
compiled    where kernels are kept
probe       a few short trials, of code whose cost is not known
numba_errors  why a kernel cannot be compiled, as a sentence
interrupts  how a run is told to stop
"""
