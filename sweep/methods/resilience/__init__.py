"""Resilience: what failures of boids do to recorded series.

analysis  what is kept, and who comes back
report    the same as a report
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
