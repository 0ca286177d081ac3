"""Hysteresis: loops between the way up and the way down of chains.

analysis  loops, and their area
report    the loops as a report
figure    their figure
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
