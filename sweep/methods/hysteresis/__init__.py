"""Hysteresis: loops between the way up and the way down of chains.

analysis  loops with areas
report    the loops as a report
figure    the loops as a figure
method    the entry of the method, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
