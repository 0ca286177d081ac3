"""Finite-size scaling: what flocks of several sizes tell of a transition.

analysis  what each size tells, crossings, collapse
report    the same as a report
figure    curves of several sizes
collapse  the same, scaled to become one
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
