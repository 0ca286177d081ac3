"""Robustness of numerics: conclusions with other time steps, orders and searches.

section   `validate`: which variants of a study are run
variants  their specs, and what a plan records of them
analysis  each conclusion in each variant
report    the same as a report
figure    the same drawn
method    its entry, its section and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
