"""Resilience: effects of failures of boids on recorded series.

analysis  retained performance, and recovery
report    the analysis as a report
method    the entry of the method, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
