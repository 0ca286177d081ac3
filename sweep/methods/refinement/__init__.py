"""Refinement: where the mean of a metric crosses a level.

analysis  where the mean crosses a level
report    the same as a report
figure    the same drawn
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
