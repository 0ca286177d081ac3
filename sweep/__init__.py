"""boidsweep: Monte Carlo experiments and parameter sweeps over boid swarms."""

import logging
import sys
from collections.abc import Mapping
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from sweep.compiled import BeforeKernels
from sweep.harmless import harmless, make_harmless

if TYPE_CHECKING:
    from sweep.storing.locations import Location
    from sweep.study import StoredStudy

__version__ = "0.5.0"


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
sys.meta_path.insert(0, BeforeKernels())
logging.getLogger(__name__).addFilter(make_harmless)


def load(study: str, results: "str | Location" = "results") -> "StoredStudy":
    """The stored results of `study`, e.g. `load("nguyen2024/separation").trials`.

    `results` is a folder, or `s3://bucket/prefix`. Raises StoreError where nothing of it is stored there.
    """
    from sweep.study import StoredStudy

    return StoredStudy(study, results)


def run(spec: str | Path | Mapping[str, Any], results: "str | Location" = "results", workers: int = 0) -> "StoredStudy":
    """Run what is missing of a study, as `sweep launch` and `sweep search` do, and return what is stored of it.

    `spec` is the path of a file, or the spec itself: a YAML text of several lines, or a mapping. It runs in `workers`
    processes, as many as there are cores for 0. Nothing is printed; trials that did not come to their end are a
    warning. Raises SpecError for what is wrong with the spec, StoreError where `results` cannot be read or written,
    ValueError for a negative number of workers, FailedTrialsError where more trials have failed than the spec allows,
    and KeyboardInterrupt, both with all finished trials stored: after the latter the same call goes on.
    """
    import warnings

    from sweep.launch import launch
    from sweep.running.executors import Loky, core_count
    from sweep.search.run import search
    from sweep.spec import load_spec, parse_spec
    from sweep.storing.locations import location

    if workers < 0:
        raise ValueError(f"workers: {workers}; allowed: 0, as many as there are cores, or more")
    if isinstance(spec, Mapping) or (isinstance(spec, str) and "\n" in spec):
        study = parse_spec(spec)
    else:
        study = load_spec(Path(spec))
    engine = Loky(workers or core_count())
    try:
        (search if study.search else launch)(study, location(results), engine)
    finally:
        engine.stop()
    stored = load(study.name, results)
    troubled = {status: count for status, count in stored.statuses().items() if status != "done"}
    if troubled:
        counts = ", ".join(f"{count:,} {status}" for status, count in sorted(troubled.items()))
        about = f"study {study.name}: {counts}, of {stored.plan.num_rows:,} trials"
        warnings.warn(harmless(about), stacklevel=2)
    return stored


def __getattr__(name: str) -> ModuleType:
    """`view`, the live simulator, which is brought along when first asked for."""
    if name == "view":
        return import_module("sweep.view")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
