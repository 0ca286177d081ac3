"""The points and jobs of a Study, and their cost, without running a trial.

order            the order of points, from coarse to fine
points           columns of parameter values while a design is built
design           the points of a study

chains           points that begin with the final flocks of other points
consistency      requirements on combinations of parameters
motors           requirements of motors and failures

senses           requirements of sensing
medium           requirements of the wind
goals            requirements of several goals
published_steps  the requirement that a model publishes each step
obstacles        requirements of moving obstacles

spreads          requirements of parameters that differ between robots
robots           differences between the boids of a point and ideal boids

code             the code that computes a study
recording        the recorded values of a trial
trial_ids        ids of trials, 12 bytes each
jobs             seed, id and parameters of each trial

cost             seconds and bytes of a trial
plan             the counts and estimates of a run
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
