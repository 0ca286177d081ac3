"""The Result of a job: the only package that calls the kernels to run trials.

simulation    one trial, kernel call by kernel call
lanes         batches of trials, one in each lane of a vector
on_device     batches of trials on a device, such as a GPU

robots        ideal boids, robots, and failures
playing       playback of a recording
scenery       the world and its obstacles, drawn from the job

derived       metrics that a spec computes from further metrics
profiles      metrics with values along an axis
remeasuring   metrics of a stored trial, from its trajectory

last_flocks   final flocks, and trials that begin with final flocks
state         the state between two kernel calls
result        the result of a trial

generators    random numbers for kernels
kinds         numbers of boids by type
world         the world of a trial, for display
following     flocks from frame to frame

looking       perceived neighbours and effects of rules, for live display
compiled      the folder of compiled kernels

probe         a few short trials of code with unknown cost
numba_errors  compiler errors of kernels, as a sentence
interrupts    signals that ask a run to stop
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
