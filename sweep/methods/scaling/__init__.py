"""Finite-size scaling: a transition in flocks of several sizes.

section   `sizes`, an axis of flocks of several sizes
analysis  curves of sizes, crossings, collapse and the state of each point
report    the analysis as a report

figure    curves of several sizes
collapse  the curves, scaled to a single curve
method    the entry of finite-size scaling, with section and command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
