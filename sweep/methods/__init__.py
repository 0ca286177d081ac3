"""Methods: sections of a spec, and analyses of results; one folder per method.

options       options of several reports

adaptive/     points get trials until intervals are narrow
refinement/   where the mean of a metric crosses a level

search/       candidates are proposed, raced, and judged on new seeds
calibration/  parameters that data support

hysteresis/   loops between the way up and the way down of chains
scaling/      the order transition in flocks of several sizes

robustness/   conclusions with other time steps, orders and searches
realities/    controllers in the design world, and in sampled realities

resilience/   effects of failures of boids on recorded series
sensitivity/  dependence of a metric on sampled parameters
ablation/     the effect of each component in which two presets differ

profiles/     metrics along a distance, a lag or a wave number
power/        the number of replicates that a goal needs
comparison/   differences between two selections of trials
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
