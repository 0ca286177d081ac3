"""The kinds of figures that `sweep plot` draws: which of them suit a study, and their
figures.

A new kind is a module of its own, which has its KIND, and one entry of KINDS. Installed
packages may bring others.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from kernels.registry import Registry
from sweep.errors import ChoiceError
from sweep.figures import (
    coverage,
    curves,
    heatmap,
    parallel,
    pareto,
    scatter,
    search,
    search_repetitions,
    trajectories,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.saving import about_study, save
from sweep.figures.selection import select
from sweep.method import own_methods
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

KINDS: Registry[FigureKind] = Registry(
    "boidsweep.figures",
    FigureKind,
    {
        "curves": curves.KIND,
        "scatter": scatter.KIND,
        "heatmap": heatmap.KIND,
        "parallel": parallel.KIND,
        "pareto": pareto.KIND,
        "coverage": coverage.KIND,
        "trajectories": trajectories.KIND,
        "history": search.HISTORY,
        "front": search.FRONT,
        "comparison": search_repetitions.COMPARISON,
        "hypervolume": search_repetitions.HYPERVOLUME,
    }
    | {
        name: kind
        for method in own_methods().values()
        for name, kind in method.figures().items()
    },
)
"""By the names that `sweep plot` takes: those of methods too."""


class Plot(NamedTuple):
    """The figures to be drawn, each with the name of its kind, and why other kinds are
    left out.
    """

    figures: list[tuple[str, Planned]]
    left_out: list[str]


def plan_figures(
    study: StoredStudy,
    names: Sequence[str],
    choices: Choices,
    known: Mapping[str, FigureKind] = KINDS,
) -> Plot:
    """The figures of the kinds called `names`, of those that are known; without names
    those of all kinds that suit the study. Nothing is drawn yet.

    Raises ChoiceError for unknown names of kinds, metrics and settings, for a choice
    that none of the kinds takes, where a kind that is named does not suit the study,
    and where none does.
    """
    for name in names:
        if name not in known:
            raise ChoiceError(unknown("kind", name, known), study.name)
    _check(study, names, choices, known)
    if names:
        chosen = list(dict.fromkeys(names))
        return Plot(
            [
                (name, planned)
                for name in chosen
                for planned in known[name].figures(study, choices)
            ],
            [],
        )
    why = {name: kind.suits(study, choices) for name, kind in known.items()}
    reasons = {name: reason for name, reason in why.items() if reason}
    names_of = {
        reason: [name for name in reasons if reasons[name] == reason]
        for reason in reasons.values()
    }
    left_out = [f"{', '.join(alike)}: {reason}" for reason, alike in names_of.items()]
    if len(reasons) == len(known):
        raise ChoiceError(
            f"no kind of figure suits it: {'; '.join(left_out)}", study.name
        )
    fitting = [name for name, reason in why.items() if not reason]
    return Plot(
        [
            (name, planned)
            for name in fitting
            for planned in known[name].figures(study, choices)
        ],
        left_out,
    )


def _check(
    study: StoredStudy,
    names: Sequence[str],
    choices: Choices,
    known: Mapping[str, FigureKind],
) -> None:
    choices.columns(study)
    selection = select(study)
    for choice in ("by", "x", "y"):
        value = getattr(choices, choice)
        taking = [name for name, kind in known.items() if choice in kind.takes]
        if value is not None:
            selection.setting(value)
            if names and not set(names) & set(taking):
                raise ChoiceError(
                    f"{choice} is for {', '.join(taking)}, not for {', '.join(names)}",
                    study.name,
                )


def draw_figures(
    study: StoredStudy,
    plot: Plot,
    folder: Path,
    formats: Sequence[str],
    below: Path | None = None,
) -> Iterator[Path]:
    """Draw the figures of a plan and `save` them. Yields each file as soon as it is
    there.
    """
    about = about_study(study)
    for kind, planned in plot.figures:
        name = f"{kind}-{planned.metric}" if planned.metric else kind
        yield from save(
            planned.draw(), folder / name, about, formats=formats, below=below
        )
