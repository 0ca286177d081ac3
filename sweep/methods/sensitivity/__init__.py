"""Sensitivity: effects of sampled parameters on a metric.

sampled          means of the points of a sample
screening        Morris's elementary effects
resampled_ranks  rank correlations
sobol_indices    fractions of variance

analysis         the table of each analysis
figure           the figure of a table
method           the entry of the method
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
