"""Realities: controllers in the design world, and in sampled pseudo-realities.

section    the section `realities` of a spec, an axis of draws
estimates  means over draws, and the mean of the worst tenth
surrogate  Sobol indices from a given sample
analysis   the gap of each controller, and the rank changes of pairs
report     the gap as a report
figure     the gap as a figure
method     the entry of the method, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
