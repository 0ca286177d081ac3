"""Robustness of numerics: conclusions with other time steps, orders and searches.

analysis  each conclusion in each variant
report    the same as a report
figure    the same drawn
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
