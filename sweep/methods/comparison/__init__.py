"""Comparison of one selection of trials with another.

sides     trials, as a command names them
matching  points that belong together
analysis  differences between sides

words     the comparison in words
report    the comparison as a report
method    the entry of the comparison, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
