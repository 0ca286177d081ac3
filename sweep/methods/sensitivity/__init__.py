"""Sensitivity: effects of sampled parameters on a metric.

sampled          means of the points of a sample
screening        Morris's elementary effects
resampled_ranks  rank correlations
sobol_indices    fractions of variance
analysis         the table of each of these
figure           their figure
method           its entry
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
