"""What names stand for: the models, metrics, maps and starts that a study may name.

Most studies name ours, and those of installed packages: BUILT_IN. A study that brings
files of its own has a catalogue with their entries too.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from kernels.metrics import METRICS, Metric
from kernels.model import Model
from kernels.models import MODELS
from kernels.starts import STARTS, Start
from kernels.worlds import MAPS, Map


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Entries of each kind by name. Two catalogues are the same if they are one object,
    also after they were sent to another process.
    """

    models: Mapping[str, Model]
    metrics: Mapping[str, Metric]
    maps: Mapping[str, Map]
    starts: Mapping[str, Start]

    @property
    def runs(self) -> tuple[str, ...]:
        """What runs to have them beside us: files of the user's own, and modules of
        packages that a spec names.
        """
        return ()

    def written(self, _kind: str, name: str, /) -> str:
        """How a spec names an entry of a kind, as "models": by its name, or by the file
        or module that has it.
        """
        return name

    def __reduce__(self) -> str | tuple[object, ...]:
        return "BUILT_IN"


BUILT_IN = Catalogue(MODELS, METRICS, MAPS, STARTS)
