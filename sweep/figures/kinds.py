"""The kinds of figures that `sweep plot` draws, and the kinds that suit a study.

A new kind is a module with a KIND, and an entry in KINDS. Installed packages may add
kinds.
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
    trajectories,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.saving import PrintSize, about_study, save
from sweep.figures.selection import select
from sweep.method import own_methods
from sweep.tables import Results
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
    }
    | {
        name: kind
        for method in own_methods().values()
        for name, kind in method.figures().items()
    },
)
"""Kinds by the names that `sweep plot` takes, including the kinds of methods."""


class Plot(NamedTuple):
    """The figures to draw, each with the name of the kind.

    `left_out` has the reason of each kind that is left out, by name.
    """

    figures: list[tuple[str, Planned]]
    left_out: dict[str, str]

    def reasons(self) -> list[str]:
        """Return a line per reason, with the names of kinds."""
        kinds = dict[str, list[str]]()
        for name, reason in self.left_out.items():
            kinds.setdefault(reason, []).append(name)
        return [f"{', '.join(names)}: {reason}" for reason, names in kinds.items()]


def plan_figures(
    study: Results,
    names: Sequence[str],
    choices: Choices,
    known: Mapping[str, FigureKind] = KINDS,
) -> Plot:
    """Plan the figures of a study, without drawing the figures.

    Parameters
    ----------
    study : Results
        One study, or several joined.
    names : sequence of str
        Names of kinds; if empty, all kinds that suit the study.
    choices : Choices
    known : mapping of str to FigureKind
        Kinds by name; by default built-in kinds and kinds of packages.

    Returns
    -------
    Plot

    Raises
    ------
    ChoiceError
        If a kind, metric or parameter is unknown, no named kind takes a choice, a named
        kind does not suit the study, or no kind does.
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
            {},
        )
    why = {name: kind.suits(study, choices) for name, kind in known.items()}
    left_out = {name: reason for name, reason in why.items() if reason}
    if len(left_out) == len(known):
        reasons = "; ".join(Plot([], left_out).reasons())
        raise ChoiceError(f"no kind of figure suits the study: {reasons}", study.name)
    return Plot(
        [
            (name, planned)
            for name, reason in why.items()
            if not reason
            for planned in known[name].figures(study, choices)
        ],
        left_out,
    )


def _check(
    study: Results,
    requested: Sequence[str],
    choices: Choices,
    available: Mapping[str, FigureKind],
) -> None:
    choices.columns(study)
    selection = select(study)
    for choice in ("by", "x", "y", "trials"):
        value = getattr(choices, choice)
        taking = [name for name, kind in available.items() if choice in kind.takes]
        if isinstance(value, str):
            selection.setting(value)
        if value and requested and not set(requested) & set(taking):
            raise ChoiceError(
                f"{choice} is for {', '.join(taking)}, not for {', '.join(requested)}",
                study.name,
            )


def draw_figures(
    study: Results,
    plot: Plot,
    folder: Path,
    formats: Sequence[str],
    below: Path | None = None,
    size: PrintSize | None = None,
) -> Iterator[Path]:
    """Draw and save the figures of a plan.

    Parameters
    ----------
    study : Results
    plot : Plot
    folder : Path
        Folder of the files.
    formats : sequence of str
        Formats of the files, see `save`.
    below : Path, optional
        Folder that the user has named, see `save`.
    size : PrintSize, optional
        Width and font for a journal.

    Yields
    ------
    Path
        Each file of a figure, as soon as all files of the figure are written.
    """
    metadata = about_study(study)
    for kind, planned in plot.figures:
        name = f"{kind}-{planned.metric}" if planned.metric else kind
        yield from save(
            planned.draw(),
            folder / name,
            metadata,
            formats=formats,
            below=below,
            size=size,
        )
