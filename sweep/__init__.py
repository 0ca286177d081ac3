"""boidsweep: Monte Carlo experiments and parameter sweeps over boid swarms."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sweep.study import StoredStudy

__version__ = "0.2.0"


def check_sibling(found: str | None, ours: str) -> None:
    """Raise ImportError unless the package `kernels` that Python finds at `found` stands beside `ours`.

    Another distribution has a package of that name too.
    """
    if found is None or Path(found).resolve().parent.parent != Path(ours).resolve().parent.parent:
        raise ImportError(
            f"boidsweep needs its own package `kernels`, but Python finds it at {found or 'no place'}: "
            "another distribution named kernels is installed; remove it, or use a separate environment"
        )


_kernels = find_spec("kernels")
check_sibling(_kernels.origin if _kernels else None, __file__)


def load(study: str, results: str | Path = "results") -> "StoredStudy":
    """The stored results of `study`, e.g. `load("nguyen2024/separation").trials`.

    Raises StoreError where nothing of it is stored below `results`.
    """
    from sweep.study import StoredStudy

    return StoredStudy(study, results)
