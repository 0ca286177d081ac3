"""The values of single trials behind means, which a page and a file have in common."""

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import KINDS, Choices, plan_figures
from sweep.figures import marks as figure_marks
from sweep.figures.drawing import PALE
from sweep.tables import JoinedStudies, StoredStudy
from tests.cases import slow_but
from tests.plotted import shown, study
from tests.studies import SMALL, launched

SHOWN: list[tuple[str, str, dict[str, Any]]] = [
    ("small", "scatter", {"metrics": ("dispersion",), "half": True}),
    ("small", "curves", {"metrics": ("speed",)}),
    ("small", "pareto", {"metrics": ("speed+", "dispersion-")}),
    ("grid", "scatter", {"metrics": ("speed",)}),
    ("grid", "curves", {"metrics": ("speed",), "by": "separation_weight"}),
    ("drawn", "scatter", {"metrics": ("speed",), "by": "n"}),
    ("repeated", "scatter", {"metrics": ("speed",)}),
    ("searched", "pareto", {"metrics": ("flock_radius-", "speed+")}),
]


def drawn(part: StoredStudy | JoinedStudies, kind: str, choices: Choices) -> Figure:
    (_, planned), *_ = plan_figures(part, [kind], choices).figures
    return planned.draw()


def panels_of(
    part: StoredStudy, kind: str, choices: Choices
) -> list[figure_marks.MarkedPanel]:
    marks = KINDS[kind].marks
    assert marks
    return marks(part, choices).panels


def dots_of(figure: Figure) -> list[float]:
    """The values of all small dots of a figure, in ascending order."""
    lines = [line for axes in figure.axes for line in axes.lines]
    dots = [line for line in lines if line.get_alpha() == PALE]
    return sorted(float(y) for line in dots for y in np.asarray(line.get_ydata()))


@pytest.mark.parametrize(("name", "kind", "choices"), slow_but(SHOWN[:3], SHOWN))
def test_a_mark_is_the_mean_of_the_trials_behind_it(
    name: str, kind: str, choices: dict[str, Any]
) -> None:
    stored = study(name).trials.set_index("trial_id")
    at = ["point"] if kind == "pareto" else ["point", "x"]
    for panel in panels_of(study(name), kind, Choices(**choices, trials=True)):
        trials = panel.trials
        assert trials is not None
        own = stored.loc[trials["trial"]]
        assert own["replicate"].tolist() == trials["replicate"].tolist()
        if kind != "curves":
            assert own[panel.y.name].tolist() == trials["y"].tolist()
        means = trials.groupby(at)["y"].agg(["mean", "size"])
        marks = panel.marks.set_index(at)
        together = marks.join(means, how="outer")
        assert len(together) == len(marks)
        assert together["size"].tolist() == together["n"].tolist()
        expected = pytest.approx(together["y"].tolist(), rel=1e-12)  # sums, reordered
        assert together["mean"].tolist() == expected
        colours = dict(zip(panel.marks["point"], panel.marks["colour"], strict=True))
        assert trials["point"].map(colours).tolist() == trials["colour"].tolist()


@pytest.mark.parametrize(("name", "kind", "choices"), slow_but(SHOWN[:3], SHOWN))
def test_a_file_has_the_values_of_the_page_on_axes_that_show_all(
    name: str, kind: str, choices: dict[str, Any]
) -> None:
    chosen = Choices(**choices, trials=True)
    figure = drawn(study(name), kind, chosen)
    panels = panels_of(study(name), kind, chosen)
    values = [y for panel in panels if panel.trials is not None for y in panel.trials.y]
    assert dots_of(figure) == sorted(values)
    low, high = figure.axes[0].get_ylim()
    assert low <= min(values)
    assert max(values) <= high
    assert shown(figure).endswith(" small dots: single trials")
    plain = Choices(**choices)
    assert dots_of(drawn(study(name), kind, plain)) == []
    for panel in panels_of(study(name), kind, plain):
        assert panel.trials is None


def test_several_studies_show_the_trials_of_each() -> None:
    joined = JoinedStudies([study("small"), study("flying")])
    values = [*study("small").trials["speed"], *study("flying").trials["speed"]]
    chosen = Choices(("speed",), trials=True)
    assert dots_of(drawn(joined, "scatter", chosen)) == sorted(values)


def test_a_trial_without_a_value_has_no_dot(tmp_path: Any) -> None:
    part = launched(SMALL, tmp_path)
    part.trials = part.trials.assign(speed=[1.0, np.nan, 3.0, 4.0, 5.0, 6.0])
    part.trials.loc[3, "status"] = "failed"
    assert dots_of(drawn(part, "scatter", Choices(("speed",), trials=True))) == [
        *(1.0, 3.0, 5.0, 6.0)
    ]


def test_a_kind_without_single_trials_is_refused_by_name() -> None:
    taking = [name for name, kind in KINDS.items() if "trials" in kind.takes]
    with pytest.raises(ChoiceError) as refused:
        plan_figures(study("grid"), ["heatmap"], Choices(trials=True))
    assert refused.value.reason == (
        f"trials is for {', '.join(taking)}, not for heatmap"
    )


@pytest.mark.parametrize(("kind", "number"), [("scatter", 6), ("curves", 36)])
def test_too_many_single_trials_are_refused(
    kind: str, number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figure_marks, "MOST_TRIALS", number)
    chosen = Choices(("speed",), trials=True)
    plan_figures(study("small"), [kind], chosen)
    monkeypatch.setattr(figure_marks, "MOST_TRIALS", number - 1)
    with pytest.raises(ChoiceError) as refused:
        plan_figures(study("small"), [kind], chosen)
    assert refused.value.reason == (
        f"has {number} values of trials; allowed: up to {number - 1};"
        " choose with where, for example separation_weight=0.5"
    )
