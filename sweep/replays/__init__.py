"""A repeated trial: compared bit for bit, as frames, or as an animation.

replaying  runs a stored trial again
verifying  runs a random sample of stored trials again
bits       compares a result with the stored values, bit for bit

flight     every frame of a trial
animation  frames as figures
video      figures as GIF or MP4
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
