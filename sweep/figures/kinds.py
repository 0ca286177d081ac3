"""The kinds of figures that `sweep plot` draws: each says whether it suits a study, and
which figures it draws then.

A new kind is a module of its own and one entry of KINDS.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from sweep.campaigns.search.asked_trials import read_asked
from sweep.errors import ChoiceError, UserError
from sweep.figures.coverage import coverage_layout, draw_coverage
from sweep.figures.curves import curves_layout, draw_curves, series_metrics
from sweep.figures.directions import direction
from sweep.figures.heatmap import draw_heatmap, heatmap_layout
from sweep.figures.parallel import draw_parallel, parallel_layout
from sweep.figures.pareto import draw_pareto, opposed_metrics, pareto_layout
from sweep.figures.saving import about_study, save
from sweep.figures.scatter import draw_scatter, scatter_layout
from sweep.figures.search import front_figure, history_figure, with_front
from sweep.figures.search_repetitions import (
    comparison_figure,
    hypervolume_figure,
    with_repetitions,
)
from sweep.figures.selection import select
from sweep.figures.sensitivity import sensitivity_figure
from sweep.figures.trajectories import draw_trajectories, trajectories_layout
from sweep.spec.recorded import Column
from sweep.tables.sensitivity import every_sampler, sensitivity
from sweep.tables.sensitivity.sampled import sampled_axis
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown


class Choices(NamedTuple):
    """What to draw: metrics as `coverage` or with their direction, `coverage+`, and
    settings.

    Without metrics all recorded ones are drawn. `half` takes their means over the last
    half of a trial.
    """

    metrics: tuple[str, ...] = ()
    by: str | None = None
    x: str | None = None
    y: str | None = None
    half: bool = False

    def columns(self, study: StoredStudy) -> list[str]:
        """The columns of the trials to draw, each with its direction as given. Raises
        ChoiceError for unknown ones.
        """
        named = [
            (direction(study, text).metric, text[len(text.rstrip("+-")) :])
            for text in self.metrics or study.metrics
        ]
        return [
            f"{Column(Column.read(metric).metric, True) if self.half else metric}{sign}"
            for metric, sign in named
        ]

    def plain(self, study: StoredStudy) -> list[str]:
        """The same without directions."""
        return [text.rstrip("+-") for text in self.columns(study)]


class Planned(NamedTuple):
    """A figure to be drawn: the metric in its file's name, or "", and how to draw."""

    metric: str
    draw: Callable[[], Figure]


class FigureKind(NamedTuple):
    """A kind of figure: what it shows, which of by, x and y it takes, and its figures
    of a study.

    `plan` draws nothing and raises ChoiceError where the kind does not suit the study.
    """

    text: str
    takes: tuple[str, ...]
    plan: Callable[[StoredStudy, Choices], list[Planned]]

    def suits(self, study: StoredStudy, choices: Choices) -> str:
        """Why this kind does not suit a study; "" where it does."""
        try:
            self.plan(study, choices)
        except UserError as error:
            return error.reason
        return ""


def _curves(study: StoredStudy, choices: Choices) -> list[Planned]:
    """One figure of all metrics, or one of each where settings need panels too."""
    names = (
        [Column.read(name).metric for name in choices.plain(study)]
        if choices.metrics
        else series_metrics(study)
    )
    first = curves_layout(study, choices.by, names[:1])
    groups = [names] if len(first.facets) == 1 else [[name] for name in names]
    layouts = [curves_layout(study, choices.by, group) for group in groups]
    labels = (
        [""]
        if len(groups) == 1 and not choices.metrics
        else ["-".join(group) for group in groups]
    )
    return [
        Planned(label, partial(draw_curves, layout))
        for label, layout in zip(labels, layouts, strict=True)
    ]


def _scatter(study: StoredStudy, choices: Choices) -> list[Planned]:
    names = choices.plain(study)
    layouts = [scatter_layout(study, name, choices.x, by=choices.by) for name in names]
    return [
        Planned(name, partial(draw_scatter, layout))
        for name, layout in zip(names, layouts, strict=True)
    ]


def _heatmap(study: StoredStudy, choices: Choices) -> list[Planned]:
    names = choices.plain(study)
    layouts = [heatmap_layout(study, name, choices.x, choices.y) for name in names]
    return [
        Planned(name, partial(draw_heatmap, layout))
        for name, layout in zip(names, layouts, strict=True)
    ]


def _parallel(study: StoredStudy, choices: Choices) -> list[Planned]:
    layouts = [parallel_layout(study, name) for name in choices.columns(study)]
    return [
        Planned(layout.direction.metric, partial(draw_parallel, layout))
        for layout in layouts
    ]


def _pareto(study: StoredStudy, choices: Choices) -> list[Planned]:
    directions = (
        choices
        if choices.metrics
        else choices._replace(metrics=tuple(opposed_metrics(study)))
    )
    metrics = directions.columns(study) if directions.metrics else []
    layout = pareto_layout(study, metrics, by=choices.by)
    return [
        Planned(
            "-".join(one.metric for one in layout.directions),
            partial(draw_pareto, layout),
        )
    ]


def _sensitivity(study: StoredStudy, choices: Choices) -> list[Planned]:
    selection = select(study)
    if not selection.sampled:
        raise ChoiceError(
            "needs an axis that samples settings, and there is none",
            study.name,
            "sensitivity",
        )
    axis = sampled_axis(study, None, every_sampler())
    about = study.axes[axis]
    selection.panels(selection.apart(about.settings), "sensitivity")

    def draw(name: str) -> Figure:
        return sensitivity_figure(sensitivity(study, name, axis))

    return [Planned(name, partial(draw, name)) for name in choices.plain(study)]


def _coverage(study: StoredStudy, _: Choices) -> list[Planned]:
    return [Planned("", partial(draw_coverage, coverage_layout(study)))]


def _trajectories(study: StoredStudy, _: Choices) -> list[Planned]:
    return [
        Planned(
            "",
            partial(draw_trajectories, trajectories_layout(study)),
        )
    ]


def _of_search(
    kind: str,
    check: Callable[[StoredStudy], object],
    draw: Callable[[StoredStudy], Figure],
) -> Callable[[StoredStudy, Choices], list[Planned]]:
    """The plan of a figure of a whole search."""

    def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
        check(study.whole)
        choice = {
            "metric": choices.metrics,
            "where": study.chosen,
            "over half": choices.half,
        }
        if given := [name for name, value in choice.items() if value]:
            what = "is of the whole search and its objectives"
            raise ChoiceError(f"{what}, and takes no {given[0]}", study.name, kind)
        return [Planned("", partial(draw, study))]

    return plan


KINDS: dict[str, FigureKind] = {
    "curves": FigureKind(
        "each series metric against time, mean and band", ("by",), _curves
    ),
    "scatter": FigureKind("a metric against each setting", ("by", "x"), _scatter),
    "heatmap": FigureKind("a metric over two settings", ("x", "y"), _heatmap),
    "parallel": FigureKind(
        "all sampled settings and a metric, the best in colour", (), _parallel
    ),
    "pareto": FigureKind(
        "two metrics against each other, and the points that no other beats",
        ("by",),
        _pareto,
    ),
    "sensitivity": FigureKind(
        "which sampled setting a metric depends on", (), _sensitivity
    ),
    "coverage": FigureKind("visits of each pixel of the map", (), _coverage),
    "trajectories": FigureKind("flights of a few trials", (), _trajectories),
    "history": FigureKind(
        "the candidates of a search as they were asked",
        (),
        _of_search("history", read_asked, history_figure),
    ),
    "front": FigureKind(
        "the front that a search has chosen, on held-out seeds",
        (),
        _of_search("front", partial(with_front, kind="front"), front_figure),
    ),
    "comparison": FigureKind(
        "repetitions of a search against random searches",
        (),
        _of_search("comparison", with_repetitions, comparison_figure),
    ),
    "hypervolume": FigureKind(
        "the hypervolume of a search by trials spent",
        (),
        _of_search(
            "hypervolume", partial(with_front, kind="hypervolume"), hypervolume_figure
        ),
    ),
}


class Plot(NamedTuple):
    """The figures to be drawn, each with its kind, and of the kinds left out, why."""

    figures: list[tuple[str, Planned]]
    left_out: list[str]


def plan_figures(study: StoredStudy, names: Sequence[str], choices: Choices) -> Plot:
    """The figures of the kinds called `names`, or without any of all that suit the
    study; nothing is drawn yet.

    Raises ChoiceError for unknown names of kinds, metrics and settings, for a choice
    that none of the kinds takes, where a kind that is named does not suit the study,
    and where none does.
    """
    for name in names:
        if name not in KINDS:
            raise ChoiceError(unknown("kind", name, KINDS), study.name)
    _check(study, names, choices)
    if names:
        chosen = list(dict.fromkeys(names))
        return Plot(
            [
                (name, planned)
                for name in chosen
                for planned in KINDS[name].plan(study, choices)
            ],
            [],
        )
    why = {name: kind.suits(study, choices) for name, kind in KINDS.items()}
    reasons = {name: reason for name, reason in why.items() if reason}
    names_of = {
        reason: [name for name in reasons if reasons[name] == reason]
        for reason in reasons.values()
    }
    left_out = [f"{', '.join(alike)}: {reason}" for reason, alike in names_of.items()]
    if len(reasons) == len(KINDS):
        raise ChoiceError(
            f"no kind of figure suits it: {'; '.join(left_out)}", study.name
        )
    fitting = [name for name, reason in why.items() if not reason]
    return Plot(
        [
            (name, planned)
            for name in fitting
            for planned in KINDS[name].plan(study, choices)
        ],
        left_out,
    )


def _check(study: StoredStudy, names: Sequence[str], choices: Choices) -> None:
    choices.columns(study)
    selection = select(study)
    for choice in ("by", "x", "y"):
        value = getattr(choices, choice)
        taking = [name for name, kind in KINDS.items() if choice in kind.takes]
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
    """Draw the figures of a plan, and `save` them; gives each file as it is there."""
    about = about_study(study)
    for kind, planned in plot.figures:
        name = f"{kind}-{planned.metric}" if planned.metric else kind
        yield from save(
            planned.draw(), folder / name, about, formats=formats, below=below
        )
