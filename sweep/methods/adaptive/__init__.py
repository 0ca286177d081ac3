"""Adaptive replicates: points get trials until intervals are narrow.

section   the form of `replicates` in a spec
rule      condition under which a point has enough trials
strategy  the trials that follow a look

analysis  the settled points
figure    half-widths of intervals against numbers of trials
method    the entry of the method
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
