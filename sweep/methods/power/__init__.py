"""Power: the number of replicates that a goal needs.

analysis  the replicates of each point
report    the replicates as a report
method    the entry of the method, with its command
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
