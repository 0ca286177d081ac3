"""The live simulator: a page in the browser, or a widget in a notebook, on the kernels that sweeps use.

The package is a function too: `sweep.view(model="nguyen2024")` is the widget. A function of that name in `sweep` would
be gone as soon as something imports the package.
"""

import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sweep.fields import Value
    from sweep.view.widget import View


class _View(ModuleType):
    def __call__(self, model: str = "nguyen2024", preset: str = "as_run", seed: int = 1, **settings: "Value") -> "View":
        """The live simulator as a widget of a notebook, e.g. `sweep.view(model="nguyen2024", n=300)`.

        `settings` are those of the model, and `map`; the others have the values of the preset. Without a front end it
        shows the picture of its first frame. Raises SpecError for what a spec would not accept, and ImportError
        without anywidget.
        """
        from sweep.view.widget import live

        return live(model, preset, seed, settings)


sys.modules[__name__].__class__ = _View
