"""The spec with more points in a region of a study, and the effect of its launch."""

import math
from collections.abc import Iterable
from typing import Any

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskRefine
from sweep.explorer.refining import Extension, Range, refined
from sweep.explorer.watching import Watched
from sweep.figures import has_scale, is_logarithmic, select
from sweep.spec import Study
from sweep.tables import StoredStudy
from sweep.text import shortened, unknown
from sweep.web import Launcher, proposed, spec_like, stored_spec


def refine(
    watched: Watched, launcher: Launcher | None, question: AskRefine
) -> dict[str, Any]:
    """Return a proposal that puts more points into a region.

    If the user has opened the spec of the study for launching, the proposal changes the
    opened spec. Otherwise the proposal changes the stored spec.

    Parameters
    ----------
    watched : Watched
        The stored studies.
    launcher : Launcher or None
        Launches the opened spec; None if pages only read.
    question : AskRefine
        Names the study, the region, the division and the replicates.

    Returns
    -------
    dict
        The fields of `sweep.web.launching.Proposal`; also `between`, the region as
        understood, and `replicates` of the spec, or None.

    Raises
    ------
    ChoiceError
        If the region is not valid. The exceptions of `refined` and `compare` are raised
        too.
    """
    stored = watched.narrow(question.study)
    opened = launcher.now() if launcher and launcher.study == question.study else None
    spec = opened or stored_spec(stored)
    between = dict(map(_range, question.between))
    if question.point:
        between = _about(stored, spec, question.point) | between
    logarithmic = _logarithmic(stored, between)
    text = refined(
        spec, Extension(between, question.parts, question.replicates, logarithmic)
    )
    if launcher and opened:
        proposal = launcher.proposed(text)
    else:
        study = spec_like(spec, text)
        proposal = proposed(study, spec.text, watched.results)
        if launcher:
            why = f"This page launches {launcher.file}, a spec of another study."
            proposal = proposal._replace(why_not=why)
    return proposal.as_reply() | {"between": between, "replicates": spec.replicates}


def _range(text: str) -> tuple[str, Range]:
    """Return a parameter with two values: NAME LOW HIGH.

    Raises ChoiceError if the text has no two finite values.
    """
    name, *ends = text.split()
    try:
        low, high = map(float, ends)
    except ValueError:
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high)):
        allowed = "NAME LOW HIGH, such as n 10 50"
        raise ChoiceError(f'between is "{shortened(text)}"; allowed: {allowed}')
    return name, (low, high)


def _about(
    stored: StoredStudy, spec: Study, points: tuple[str, ...]
) -> dict[str, Range]:
    """Return the least and the largest value of each swept number at some points.

    Raises ChoiceError for an unknown point.
    """
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
    """Return the parameters whose axes are drawn logarithmically."""
    chosen = select(stored)
    columns = [name for name in names if name in chosen.points]
    return {name for name in columns if is_logarithmic(chosen, name)}
