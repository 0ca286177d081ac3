"""Models, metrics, maps and starts that a study may name.

Most studies name built-in entries and entries of installed packages: BUILT_IN. The
catalogue of a study with custom files also has the entries of these files.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from kernels.metrics import METRICS, Metric
from kernels.model import Model
from kernels.models import MODELS
from kernels.profiles import PROFILES, Profile
from kernels.starts import STARTS, Start
from kernels.worlds import MAPS, Map


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Entries of each kind by name.

    Two catalogues are equal if they are one object, also after a transfer to another
    process.
    """

    models: Mapping[str, Model]
    metrics: Mapping[str, Metric]
    maps: Mapping[str, Map]
    starts: Mapping[str, Start]
    profiles: Mapping[str, Profile]

    @property
    def runs(self) -> tuple[str, ...]:
        """Files of custom code, and modules of packages, that a spec names."""
        return ()

    def written(self, _kind: str, name: str, /) -> str:
        """Return the string by which a spec names an entry.

        The string is the name of a built-in entry, or the file or module that has a
        custom entry.

        Parameters
        ----------
        _kind : str
            The kind of the entry, such as "models".
        name : str
        """
        return name

    def __reduce__(self) -> str | tuple[object, ...]:
        return "BUILT_IN"


BUILT_IN = Catalogue(MODELS, METRICS, MAPS, STARTS, profiles=PROFILES)
