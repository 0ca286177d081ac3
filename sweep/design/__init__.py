"""From a Study to its points and jobs, and what they cost, without running any.

order        from coarse to fine
points       columns of settings while they grow
design       the points of a study
chains       which points begin where others end
consistency  what settings fulfil together
motors       what those of motors and breakdowns do
senses       what those of sensing do
medium       what those of the wind do
goals        what several of them need
published_steps  that a model publishes each step
obstacles    what obstacles that move need
spreads      what parameters that differ from robot to robot do
robots       in what the boids of a point differ from ideal ones
code         which code computes a study
recording    what a trial records
trial_ids    12 bytes a trial
jobs         a trial's seed, id and settings
cost         seconds and bytes of a trial
plan         what a launch would run
"""
