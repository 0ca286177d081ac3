"""Comparison: what one selection of trials has more or less than another.

sides     trials as a command names them
matching  points that belong together
analysis  what differs between sides
words     the same in words
report    the same as a report
method    its entry, and its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
