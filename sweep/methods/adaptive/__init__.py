"""Adaptive replicates: points get trials until intervals are narrow.

section   the form of `replicates` in a spec
rule      when a point has enough trials
strategy  which trials follow a look
analysis  which points are settled
figure    half-widths of intervals against numbers of trials
method    its entry
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
