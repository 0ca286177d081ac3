"""The kinds of figures of `sweep plot`: what suits a study, what is drawn into which
files, and what is refused.
"""

import copy
from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from sweep import figures
from sweep.cli.app import app
from sweep.errors import ChoiceError, StoreError
from sweep.figures import KINDS, Choices, FigureKind, Planned
from sweep.figures.kinds import draw_figures, plan_figures
from sweep.method import own_methods
from sweep.methods.scaling import analysis as scaling
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.plotted import SPECS, study
from tests.studies import relaunch


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    """A collapse is fitted to ten resamples and not to 200: its interval is not looked
    at here.
    """
    few = partial(scaling.collapse, resamples=10)
    monkeypatch.setattr(scaling, "collapse", few)


def first_file(name: str, folder: Path, kind: str, **choices: object) -> Path:
    """The first figure of a kind that `sweep plot` draws of a study into a folder."""
    chosen = Choices(**choices)  # type: ignore[arg-type]
    plot = plan_figures(study(name), [kind], chosen)
    first = plot._replace(figures=plot.figures[:1])
    (path,) = draw_figures(study(name), first, folder, ("svg",))
    return path


def blank(
    name: str,
    folder: Path,
    *kinds: str,
    formats: tuple[str, ...] = ("png",),
    where: Mapping[str, object] | None = None,
    **choices: object,
) -> list[Path]:
    """What `sweep plot` draws of a study into a folder, in its order, with an empty
    figure in place of each: where it is about the files and not about what is in them.
    """
    chosen = Choices(**choices)  # type: ignore[arg-type]
    part = study(name).where(**(where or {}))
    plot = plan_figures(part, kinds, chosen)
    empty = [
        (kind, planned._replace(draw=partial(Figure, (1, 1))))
        for kind, planned in plot.figures
    ]
    return list(draw_figures(part, plot._replace(figures=empty), folder, formats))


def names(paths: list[Path]) -> list[str]:
    return [path.name for path in paths]


@pytest.mark.parametrize(
    ("name", "suited"),
    [
        ("small", ["curves", "scatter"]),
        ("grid", ["curves", "scatter", "heatmap"]),
        ("drawn", ["scatter", "heatmap", "parallel", "sensitivity"]),
        ("covering", ["curves", "scatter", "pareto", "coverage"]),
        ("flying", ["curves", "scatter", "trajectories"]),
        ("ablated", ["scatter", "effects"]),
        ("real", ["scatter", "effects"]),
        ("repeated", ["scatter", "narrowing"]),
        (
            "searched",
            [
                "scatter",
                "heatmap",
                "parallel",
                "pareto",
                "history",
                "front",
                "comparison",
                "hypervolume",
            ],
        ),
    ],
)
def test_every_kind_says_whether_it_suits(name: str, suited: list[str]) -> None:
    assert [
        kind for kind in KINDS if not KINDS[kind].suits(study(name), Choices())
    ] == suited
    plot = plan_figures(study(name), [], Choices())
    assert list(dict.fromkeys(kind for kind, _ in plot.figures)) == suited
    assert list(plot.left_out) == [kind for kind in KINDS if kind not in suited]
    assert len(plot.reasons()) == len(set(plot.left_out.values())), "said once"


SUITING = {
    "small": ["curves", "scatter"],
    "grid": ["heatmap"],
    "drawn": ["parallel", "sensitivity"],
    "covering": ["pareto", "coverage"],
    "flying": ["trajectories"],
    "ablated": ["effects"],
    "repeated": ["narrowing"],
    "searched": ["history", "front", "comparison", "hypervolume"],
    "chained": ["hysteresis"],
    "refined": ["phase"],
    "validated": ["validity"],
    "drawn_realities": ["gap"],
    "sized": ["scaling", "collapse"],
    "profiled": ["profiles"],
    "calibrated": ["posterior"],
}
"""Kinds of figures by a study that they suit."""


def test_each_kind_has_a_study_that_it_suits() -> None:
    assert sorted(KINDS) == sorted(kind for some in SUITING.values() for kind in some)


@pytest.mark.parametrize("value", slow_but([1.0], [1.0, 0.0, np.nan]))
@pytest.mark.parametrize("name", SUITING)
def test_each_kind_is_drawn_of_a_constant_metric_or_says_why_not(
    name: str, value: float
) -> None:
    """Also of one that has no value at all, and where an axis would be logarithmic."""
    part = copy.copy(study(name))
    metrics = {one for one in part.trials if one.removesuffix("_half") in part.metrics}
    part.trials = part.trials.assign(**dict.fromkeys(metrics, value))
    for kind in SUITING[name]:
        with suppress(ChoiceError):  # which says why it is not drawn
            (_, planned), *_ = plan_figures(part, [kind], Choices()).figures
            planned.draw().draw_without_rendering()


def test_of_a_search_only_its_objectives_are_drawn() -> None:
    """Unless others are asked for."""
    part = study("searched")
    assert part.metrics == ["flock_radius", "speed", "dispersion"]
    plot = plan_figures(part, [], Choices())
    drawn = {word for _, planned in plot.figures for word in planned.metric.split("-")}
    assert drawn == {"flock_radius", "speed", ""}
    asked = plan_figures(part, ["scatter"], Choices(("dispersion",)))
    assert [planned.metric for _, planned in asked.figures] == ["dispersion"]


def test_files_are_named_by_kind_and_metric_in_the_order_asked_for(
    tmp_path: Path,
) -> None:
    drawn = blank(
        "drawn",
        tmp_path,
        "pareto",
        "parallel",
        metrics=("speed+", "dispersion-"),
        formats=("svg", "png"),
    )
    assert names(drawn) == [
        "pareto-speed-dispersion.svg",
        "pareto-speed-dispersion.png",
        "parallel-speed.svg",
        "parallel-speed.png",
        "parallel-dispersion.svg",
        "parallel-dispersion.png",
    ]
    assert sorted(names(drawn)) == sorted(path.name for path in tmp_path.iterdir())


REPEATED = [
    ("small", "curves", {}),
    ("grid", "scatter", {"metrics": ("speed",)}),
    ("grid", "heatmap", {"metrics": ("speed",)}),
    ("drawn", "parallel", {"metrics": ("speed",)}),
    ("drawn", "sensitivity", {"metrics": ("speed",)}),
    ("covering", "pareto", {}),
    ("covering", "coverage", {}),
    ("flying", "trajectories", {}),
    ("searched", "history", {}),
    ("searched", "front", {}),
    ("searched", "comparison", {}),
    ("searched", "hypervolume", {}),
    ("refined", "phase", {}),
    ("chained", "hysteresis", {}),
    ("validated", "validity", {}),
    ("drawn_realities", "gap", {}),
    ("real", "effects", {}),
    ("sized", "scaling", {}),
    ("sized", "collapse", {}),
    ("profiled", "profiles", {}),
    ("calibrated", "posterior", {}),
    ("repeated", "narrowing", {"metrics": ("speed",)}),
]
"""Each kind, of a study and with choices that suit it."""
RESAMPLED = ("heatmap", "sensitivity", "collapse")
"""Kinds with random numbers, and one whose colours are an image."""


@pytest.mark.parametrize(
    ("name", "kind", "choices"),
    slow_but([one for one in REPEATED if one[1] in RESAMPLED], REPEATED),
)
def test_a_repeat_has_the_same_bytes(
    name: str, kind: str, choices: dict[str, object], tmp_path: Path
) -> None:
    """Of every format in tests/test_figures.py; what differs between kinds shows in an
    SVG.
    """
    first = first_file(name, tmp_path / "a", kind, **choices)
    again = first_file(name, tmp_path / "b", kind, **choices)
    assert first.read_bytes() == again.read_bytes()


def test_every_kind_is_among_those_whose_bytes_are_compared() -> None:
    assert {kind for _, kind, _ in REPEATED} == set(KINDS)


def test_files_say_which_points_they_show(tmp_path: Path) -> None:
    (path,) = blank(
        "grid",
        tmp_path,
        "scatter",
        metrics=("speed",),
        where={"borders": "torus"},
        formats=("pdf",),
    )
    assert b"Where: borders=torus" in path.read_bytes()


def test_over_half_takes_the_means_of_the_last_half(tmp_path: Path) -> None:
    drawn = blank(
        "drawn", tmp_path, "heatmap", "parallel", metrics=("speed+",), half=True
    )
    assert names(drawn) == ["heatmap-speed_mean.png", "parallel-speed_mean.png"]
    drawn = blank("covering", tmp_path, "pareto", half=True)
    assert names(drawn) == ["pareto-coverage_mean-coverage_cv_mean.png"]


def test_curves_that_need_panels_are_a_figure_a_metric() -> None:
    plot = plan_figures(study("grid"), ["curves"], Choices())
    assert [planned.metric for _, planned in plot.figures] == ["speed", "flock_radius"]
    plot = plan_figures(
        study("grid").where(separation_weight=2, alignment_weight=1),
        ["curves"],
        Choices(),
    )
    assert [planned.metric for _, planned in plot.figures] == [""]


def test_the_sensitivity_of_some_points_is_of_these_alone() -> None:
    choices, part = Choices(metrics=("speed",)), study("drawn").where(n=6)
    ((_, planned),) = plan_figures(part, ["sensitivity"], choices).figures
    assert "30 points, 60 trials;" in planned.draw().get_supxlabel()
    ((_, planned),) = plan_figures(study("drawn"), ["sensitivity"], choices).figures
    assert "30 points, 60 trials per panel;" in planned.draw().get_supxlabel()


def test_a_new_kind_is_one_entry(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def plan(one: StoredStudy, _: Choices) -> list[Planned]:
        if one.name != "small":
            raise StoreError("is for small", one.name, "blank")
        return [Planned("", partial(Figure, (1, 1)))]

    monkeypatch.setitem(KINDS, "blank", FigureKind("nothing", (), plan))
    assert names([first_file("small", tmp_path, "blank")]) == ["blank.svg"]
    assert (
        "blank" in dict(plan_figures(study("small"), [], Choices()).figures)
    ) is True
    left_out = plan_figures(study("grid"), [], Choices()).left_out
    assert left_out["blank"] == "is for small"


@pytest.mark.parametrize(
    ("name", "kinds", "choices", "message"),
    [
        (
            "grid",
            ["scater"],
            {},
            'study grid: unknown kind "scater"; did you mean "scatter"?',
        ),
        (
            "grid",
            [],
            {"metrics": ("sped",)},
            'study grid: unknown metric "sped"; did you mean "speed"?',
        ),
        (
            "grid",
            [],
            {"by": "border"},
            'study grid: unknown varied parameter "border"; did you mean "borders"?',
        ),
        (
            "grid",
            ["curves"],
            {"x": "borders"},
            "study grid: x is for scatter, heatmap, scaling, collapse, not for curves",
        ),
        (
            "small",
            ["coverage"],
            {},
            "study small: has no heatmaps; record: {heatmaps: true} stores heatmaps",
        ),
        ("grid", ["effects"], {}, "no axis ablates a preset or components"),
        ("grid", ["history"], {}, "study grid: not a search"),
        (
            "searched",
            ["front"],
            {"metrics": ("speed",)},
            "study searched: front shows the whole search and its",
        ),
        ("searched", ["history"], {"half": True}, "and takes no over half"),
        (
            "searched",
            ["history"],
            {"where": {"n": 12}},
            "study searched: history shows the whole search and its objectives, and"
            " takes no where",
        ),
        (
            "drawn",
            ["sensitivity"],
            {"where": {"separation_weight": [0.31797524413849243, 0.3614009002029108]}},
            "study drawn: sensitivity where uses separation_weight, which weights"
            " samples; allowed: parameters of",
        ),
        (
            "small",
            [],
            {"where": {"separation_weight": 1}, "metrics": ("dispersion",)},
            "no kind of figure suits the study",
        ),
    ],
)
def test_what_cannot_be_drawn_is_said_before_any_work(
    name: str, kinds: list[str], choices: dict[str, Any], message: str
) -> None:
    part = study(name).where(**choices.get("where", {}))
    chosen = {key: value for key, value in choices.items() if key != "where"}
    with pytest.raises(ChoiceError) as error:
        plan_figures(part, kinds, Choices(**chosen))
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_the_command_prints_the_paths_and_what_is_left_out(tmp_path: Path) -> None:
    relaunch(SPECS["small"], tmp_path)
    command = [
        "plot",
        "small",
        "--results",
        str(tmp_path),
        "--metric",
        "speed",
        "--over",
        "half",
    ]
    done = CliRunner().invoke(app, [*command, "--format", "png", "--format", "pdf"])
    folder = tmp_path / "small" / "figures"
    wanted = [
        folder / name
        for name in (
            "curves-speed.png",
            "curves-speed.pdf",
            "scatter-speed_mean.png",
            "scatter-speed_mean.pdf",
        )
    ]
    assert done.stdout.splitlines() == [str(path) for path in wanted]
    assert all(path.exists() for path in wanted)
    assert "kinds that do not suit the study; --why prints why\n" in done.stderr
    before = wanted[0].stat().st_ino
    part = ["--where", "separation_weight=1", "--why"]
    again = CliRunner().invoke(app, [*command, *part])
    assert (
        "not drawn: heatmap: needs two varied parameters; the study has" in again.stderr
    )
    assert again.stdout.splitlines() == [str(wanted[0])]
    assert wanted[0].stat().st_ino != before
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        path.name for path in wanted
    )


def test_every_figure_of_a_method_is_offered_to_notebooks() -> None:
    names = [name for method in own_methods().values() for name in method.in_figures]
    assert "history_figure" in names
    assert all(callable(getattr(figures, name)) for name in names)
