"""Ablation: the effect of each component in which two presets differ.

analysis  paired effects of the components
figure    the effects as a figure
method    the entry of the method
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
