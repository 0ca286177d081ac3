"""Robustness of numerics: conclusions with other time steps, orders and searches.

section   `validate`: the variants of a study that are run
variants  specs of the variants, with the record in a plan

analysis  each conclusion in each variant
report    the conclusions as a report

figure    the conclusions as a figure
method    the entry of the method, with section and command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
