"""Refinement: the boundary at which the mean of a metric crosses a level.

section   `refine`, with its keys and its rule in plans
rule      a grid that becomes finer where a mean crosses a level

steepest  a grid that becomes finer where a mean changes most
strategy  the points that a launch runs

analysis  the boundary in a stored study
report    the boundary as a report
figure    the boundary as a figure
method    the entry of refinement, with section and command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
