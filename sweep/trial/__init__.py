"""From a job to its Result: the one door to the kernels.

simulation  a flock in its world, call by call
state       what is between two calls
result      what a trial gave
generators  random numbers for kernels
world       the same world, to be shown
compiled    where kernels are kept
interrupts  how a run is told to stop
"""
