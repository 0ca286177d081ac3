"""Profiles: means of metrics with an axis, exponents, and differences of two studies.

analysis  means with simultaneous confidence intervals
report    the means as a report
figure    the means as a figure
method    the entry of the method, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
