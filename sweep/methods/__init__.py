"""Methods: what may be asked of the results of a study, a folder each.

options       options that several reports have
adaptive/     points get trials until intervals are narrow
refinement/   where the mean of a metric crosses a level
hysteresis/   loops between the way up and the way down of chains
scaling/      what flocks of several sizes tell of a transition
robustness/   conclusions with other time steps, orders and searches
resilience/   what failures of boids do to recorded series
sensitivity/  which sampled settings a metric depends on
ablation/     what each detail does in which two presets differ
power/        how many replicates a goal needs
comparison/   what one selection of trials has more or less than another
"""
