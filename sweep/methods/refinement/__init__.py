"""Refinement: where the mean of a metric crosses a level.

section   `refine`, its keys and its rule in plans
rule      a grid that becomes finer where a mean crosses a level
steepest  the same where a mean changes most
strategy  which points a launch asks for
analysis  where the mean crosses a level
report    the same as a report
figure    the same drawn
method    its entry, its section and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
