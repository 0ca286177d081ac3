"""What a spec would be with more points in a region of its study, and what its launch
would change.
"""

import math
from collections.abc import Iterable
from typing import Any

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskRefine
from sweep.explorer.refining import Extension, Range, refined
from sweep.explorer.watching import Watched
from sweep.figures.scales import is_logarithmic
from sweep.figures.selection import has_scale, select
from sweep.spec.study import Study
from sweep.tables.stored_study import StoredStudy
from sweep.text import shortened, unknown
from sweep.web.launching import Launcher, proposed, spec_like, stored_spec


def refine(
    watched: Watched, launcher: Launcher | None, asked: AskRefine
) -> dict[str, Any]:
    """The proposal, see `sweep.web.launching`, with its `between`: the region as it is
    understood, and `replicates`, how many the spec has, or null.

    It is made of the spec that the user has opened for launching where that is the one
    of the study, and of the stored one otherwise. Raises ChoiceError for a region that
    is none, and as `refined` and `compare`.
    """
    stored = watched.narrow(asked.study)
    opened = launcher.now() if launcher and launcher.study == asked.study else None
    spec = opened or stored_spec(stored)
    between = dict(map(_range, asked.between))
    if asked.point:
        between = _about(stored, spec, asked.point) | between
    logarithmic = _logarithmic(stored, between)
    text = refined(spec, Extension(between, asked.parts, asked.replicates, logarithmic))
    if launcher and opened:
        found = launcher.proposed(text)
    else:
        study = spec_like(spec, text)
        found = proposed(study, spec.text, watched.results)
        if launcher:
            why = f"This page launches {launcher.file}, which is another study."
            found = found._replace(why_not=why)
    return found.as_reply() | {"between": between, "replicates": spec.replicates}


def _range(text: str) -> tuple[str, Range]:
    """A setting with two values. Raises ChoiceError for a text that has none."""
    name, *ends = text.split()
    try:
        low, high = map(float, ends)
    except ValueError:
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high)):
        allowed = "NAME LOW HIGH, as n 10 50"
        raise ChoiceError(f'between is "{shortened(text)}"; allowed: {allowed}')
    return name, (low, high)


def _about(
    stored: StoredStudy, spec: Study, points: tuple[str, ...]
) -> dict[str, Range]:
    """The least and the largest value that points have of each number that is swept."""
    table = stored.points
    for point in points:
        if point not in table.index:
            raise ChoiceError(unknown("point", point, table.index), stored.name)
    swept = {name for axis in spec.axes for name in axis.columns}
    chosen = table.loc[[*points]]
    return {
        str(name): (float(chosen[name].min()), float(chosen[name].max()))
        for name in table.columns
        if name in swept and has_scale(table[name])
    }


def _logarithmic(stored: StoredStudy, names: Iterable[str]) -> set[str]:
    """The settings whose axes are drawn logarithmically."""
    chosen = select(stored)
    known = [name for name in names if name in chosen.points]
    return {name for name in known if is_logarithmic(chosen, name)}
