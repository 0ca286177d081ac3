"""Sensitivity: which sampled settings a metric depends on.

sampled          means of the points of a sample
screening        Morris's elementary effects
resampled_ranks  rank correlations
sobol_indices    shares of variance
analysis         the table of each of these
figure           the same drawn
method           its entry
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
