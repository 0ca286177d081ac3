"""What the page is told: the numbers of `sweep table` and of the figures; and nothing
for a question that is none.
"""

import base64
import json
import shlex
from itertools import cycle, product
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.errors import ChoiceError, UserError
from sweep.explorer.asking import MOST_CHARACTERS, MOST_VALUES, AskPoints, read
from sweep.explorer.site import QUESTIONS, site_of
from sweep.explorer.trials import looked_at, median_trial
from sweep.explorer.watching import Watched
from sweep.figures import kinds, marks
from sweep.store.lock import Lock
from sweep.store.places import place_of
from sweep.tables.stored_study import StoredStudy
from tests import plotted
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import IMPOSSIBLE, SMALL, launched
from tests.studies import read as study_of

CHOICES: dict[str, list[tuple[str, str]]] = {
    "all": [],
    "sorted": [("metric", "speed"), ("sort", "speed:desc")],
    "half": [("half", "yes"), ("metric", "speed")],
}


def told(results: Path, question: str, *pairs: tuple[str, str]) -> dict[str, Any]:
    """An answer, as the page reads it."""
    answer = site_of(Watched(results)).answers[question](pairs)
    found: dict[str, Any] = json.loads(json.dumps(answer, allow_nan=False))
    return found


def printed(command: str) -> str:
    """What a command that the page shows prints, in JSON."""
    done = sweep(Path.cwd(), *shlex.split(command)[1:], "--json")
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("name", "choice"),
    slow_but(
        zip(plotted.SPECS, cycle(CHOICES), strict=False),
        product(plotted.SPECS, CHOICES),
    ),
)
def test_every_number_of_the_table_is_that_of_sweep_table(
    name: str, choice: str
) -> None:
    results = plotted.study(name).store.folder.parent
    metric = plotted.study(name).metrics[0]
    pairs = [(key, value.replace("speed", metric)) for key, value in CHOICES[choice]]
    answer = told(results, "points", ("study", name), *pairs)
    assert answer["rows"] == json.loads(printed(answer["command"]))
    assert len(answer["cells"]) == len(answer["points"]) == answer["total"]


def test_a_row_of_several_points_says_how_many() -> None:
    results = plotted.study("grid").store.folder.parent
    answer = told(results, "points", ("study", "grid"), ("by", "separation_weight"))
    assert answer["headings"] == ["separation_weight", "points"]
    assert [cells[:2] for cells in answer["cells"]] == [
        ["0.5", "6"],
        ["1", "6"],
        ["2", "6"],
    ]
    assert answer["rows"] == json.loads(printed(answer["command"]))
    assert answer["points"] == []


ALIKE = {"searched", "small", "flying", "real", "touring"}
"""Studies whose kinds of figures with a mark a point suit others too."""


@pytest.mark.parametrize("name", slow_but(plotted.SPECS.keys() - ALIKE, plotted.SPECS))
def test_the_marks_of_points_are_their_rows_of_the_table(name: str) -> None:
    """Of each kind that suits: mean, interval and number of trials."""
    study = plotted.study(name)
    results = study.store.folder.parent
    table = told(results, "points", ("study", name))
    rows = dict(zip(table["points"], table["rows"], strict=True))
    first = told(results, "figure", ("study", name))
    checked = 0
    for kind, about in first["kinds"].items():
        if about["why_not"]:
            continue
        figure = told(results, "figure", ("study", name), ("kind", kind))
        if not figure["metrics"]:  # of a whole search; see test_other_views.py
            continue
        if figure["form"] == "paths":  # see the next test
            continue
        for panel in figure["panels"]:
            metric = figure["metrics"][-1].rstrip("+-")
            for mark in _dots(panel):
                if panel["x"]["name"] == "frame" or " " in mark["point"]:
                    continue
                row = rows[mark["point"]]
                assert (mark["y"], mark["n"]) == (row[metric], row[f"{metric}_n"])
                if "low" in mark:
                    ends = (row[f"{metric}_low"], row[f"{metric}_high"])
                    assert (mark["low"], mark["high"]) == ends
                checked += 1
    assert checked >= len(study.points)


def test_where_intervals_narrow_to_is_their_row_of_the_table() -> None:
    """It is not what the page shows first, where scatter suits too."""
    results = plotted.study("repeated").store.folder.parent
    asked = [("study", "repeated"), ("metric", "speed")]
    table = told(results, "points", *asked)
    assert told(results, "figure", *asked)["kind"] == "scatter"
    figure = told(results, "figure", *asked, ("kind", "narrowing"))
    marks = _dots(figure["panels"][0])
    last = {mark["point"]: mark for mark in marks}
    for point, row in zip(table["points"], table["rows"], strict=True):
        half = (row["speed_high"] - row["speed_low"]) / 2.0
        assert last[point]["y"] == pytest.approx(half, rel=1e-9)  # sums, reordered
        assert last[point]["x"] == last[point]["n"] == row["speed_n"] == 9
        assert [one["x"] for one in marks if one["point"] == point] == [3, 4, 6, 8, 9]
    assert " plot repeated narrowing --metric speed " in figure["command"]


def _dots(panel: dict[str, Any]) -> list[dict[str, Any]]:
    columns, data = panel["marks"]["columns"], panel["marks"]["data"]
    return [dict(zip(columns, row, strict=True)) for row in data]


@pytest.mark.parametrize("name", ["small", "grid", "searched"])
def test_the_command_below_a_figure_draws_that_figure(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One figure, of the same kind and metric, that says the same of itself."""
    seen: list[tuple[str, str]] = []

    def drawn(
        _: StoredStudy, plot: kinds.Plot, *__: object, **___: object
    ) -> list[Path]:
        seen.extend((kind, plotted.shown(one.draw())) for kind, one in plot.figures)
        return []

    monkeypatch.setattr("sweep.figures.draw_figures", drawn)
    results = plotted.study(name).store.folder.parent
    given = [("study", name), ("half", "yes"), ("where", "separation_weight < 1.5")]
    figure = told(results, "figure", *given)
    done = sweep(results, *shlex.split(figure["command"])[1:])
    assert done.returncode == 0, done.stderr
    assert seen == [(figure["kind"], figure["note"].replace("\n", " "))]


FILES = [
    ("small", "scatter", "svg", "89"),
    ("small", "curves", "png", ""),
    ("grid", "heatmap", "pdf", "183"),
    ("drawn", "scatter", "png", "89"),
    ("covering", "pareto", "svg", ""),
    ("repeated", "narrowing", "svg", ""),
    ("profiled", "profiles", "pdf", ""),
    ("searched", "history", "svg", ""),
    ("searched", "front", "png", "183"),
]


@pytest.mark.parametrize(
    ("name", "kind", "ending", "width"), slow_but(FILES[:1], FILES)
)
def test_a_file_of_a_figure_is_the_file_of_its_command(
    name: str, kind: str, ending: str, width: str, tmp_path: Path
) -> None:
    """The name and every byte; where a command writes several files, the first."""
    results = plotted.study(name).store.folder.parent
    pairs = [("study", name), ("kind", kind), ("width", width)]
    figure = told(results, "figure", *pairs)
    assert (f"--width {width}" in figure["command"]) == bool(width)
    command = [*shlex.split(figure["command"])[1:], "--format", ending]
    done = sweep(Path.cwd(), *command, "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    first = Path(done.stdout.splitlines()[0])
    file = told(results, "file", *pairs, ("format", ending))
    assert (file["name"], base64.b64decode(file["base64"])) == (
        first.name,
        first.read_bytes(),
    )


@pytest.mark.parametrize(
    ("kind", "why_not"), [("scatter", ""), ("curves", "has 36 values of trials")]
)
def test_single_trials_are_in_the_command_or_have_a_reason_why_not(
    kind: str, why_not: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(marks, "MOST_TRIALS", 6)
    results = plotted.study("small").store.folder.parent
    pairs = [("study", "small"), ("kind", kind)]
    figure = told(results, "figure", *pairs)
    assert figure["trials_why_not"].startswith(why_not)
    assert "--trials" not in figure["command"]
    figure = told(results, "figure", *pairs, ("trials", "yes"))
    assert figure["refusal"] == ""
    if why_not:
        assert "--trials" not in figure["command"]
        return
    assert f"plot small {kind} --trials " in figure["command"]
    columns = figure["panels"][0]["trials"]["columns"]
    assert set(columns) == {"x", "y", "colour", "trial", "replicate", "point"}


def test_a_heatmap_is_drawn_as_if_no_single_trials_were_chosen() -> None:
    results = plotted.study("drawn").store.folder.parent
    pairs = [("study", "drawn"), ("kind", "heatmap"), ("trials", "yes")]
    figure = told(results, "figure", *pairs)
    assert "--trials" not in figure["command"]
    assert figure["trials_why_not"].endswith("not for heatmap")
    assert [panel["trials"] for panel in figure["panels"]] == [None, None]


def test_files_that_cannot_be_drawn_are_refused_before_any_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = plotted.study("small").store.folder.parent
    for pair, words in (
        (("format", "gif"), 'unknown format "gif"'),
        (("width", "9000"), 'unknown width in mm "9000"'),
    ):
        with pytest.raises(ChoiceError, match=words):
            told(results, "file", ("study", "small"), pair)
    repeated: list[str] = []

    def again(*_: object, **__: object) -> list[Path]:
        """Another page that asks for a file while this one is drawn."""
        with pytest.raises(ChoiceError) as refused:
            told(results, "file", ("study", "small"))
        repeated.append(refused.value.reason)
        raise ChoiceError("cannot be written")

    with monkeypatch.context() as patched:
        patched.setattr("sweep.explorer.drawn.draw_figures", again)
        with pytest.raises(ChoiceError, match="cannot be written"):
            told(results, "file", ("study", "small"))
    assert repeated == ["another file is drawn at the moment; repeat the request"]
    assert told(results, "file", ("study", "small"))["name"] == "scatter-speed.png"


def test_a_kind_that_does_not_suit_has_its_reason_and_its_choices() -> None:
    """So a choice that the reason names can be made."""
    results = plotted.study("small").store.folder.parent
    answer = told(results, "figure", ("study", "small"), ("kind", "heatmap"))
    assert (answer["kind"], answer["takes"]) == ("heatmap", ["x", "y"])
    assert answer["refusal"].startswith("needs two varied parameters")
    assert answer["refusal"] == answer["kinds"]["heatmap"]["why_not"]
    assert answer["settings"] == ["separation_weight"]


DERIVED = {
    "repeated": ["borders"],  # minimum_image follows
    "grid": ["separation_weight", "alignment_weight", "borders"],
    "sized": ["n", "separation_weight"],  # width and height follow
    "chained": ["direction", "separation_weight"],
    "ablated": ["detail"],
    "drawn": ["n", "separation_weight", "alignment_weight", "cohesion_weight"],
}


@pytest.mark.parametrize("name", slow_but(["repeated"], DERIVED))
def test_only_what_varies_freely_is_offered_and_named(name: str) -> None:
    study = plotted.study(name)
    results = study.store.folder.parent
    assert told(results, "figure", ("study", name))["settings"] == DERIVED[name]
    point = str(study.points.index[0])
    answer = told(results, "trials", ("study", name), ("point", point))
    assert [*answer["settings"][point]] == DERIVED[name]


def test_kinds_of_searches_are_offered_to_searches() -> None:
    results = plotted.study("small").store.folder.parent
    of_search = {name for name, kind in kinds.KINDS.items() if kind.of_search}
    answer = told(results, "figure", ("study", "small"))
    assert not of_search & answer["kinds"].keys()
    chosen = told(results, "figure", ("study", "small"), ("kind", "front"))
    assert of_search & chosen["kinds"].keys() == {"front"}
    assert chosen["refusal"]


def test_no_more_marks_leave_the_server_than_allowed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = plotted.study("drawn").store.folder.parent
    asked = [("study", "drawn"), ("x", "separation_weight")]
    whole = told(results, "figure", *asked, ("kind", "scatter"))
    monkeypatch.setattr(marks, "MOST_MARKS", 20)
    few = told(results, "figure", *asked, ("kind", "scatter"))
    assert [len(one["panels"][0]["marks"]["data"]) for one in (whole, few)] == [60, 20]
    assert few["thinned"] == "1 of 3 marks of 60"
    monkeypatch.setattr(marks, "MOST_MARKS", 5)
    refused = told(results, "figure", *asked[:1], ("kind", "heatmap"))
    assert "18 cells; allowed: up to 5" in refused["refusal"]
    assert refused["panels"] == []
    with pytest.raises(ChoiceError, match="18 cells; allowed: up to 5"):
        told(results, "file", *asked[:1], ("kind", "heatmap"))


def test_trials_that_are_not_done_come_first_then_worst_median_best() -> None:
    found = pd.DataFrame(
        {
            "status": ["done", "failed", "done", "done", "done"],
            "speed": [3.0, float("nan"), 1.0, 2.0, float("nan")],
        }
    )
    more = looked_at(found, "speed", "high")
    assert list(more.index) == [1, 2, 3, 0, 4]
    assert list(more["part"]) == ["", "worst", "median", "best", ""]
    less = looked_at(found, "speed", "low")
    assert list(less["part"]) == ["", "worst", "median", "best", ""]
    assert list(less.index) == [1, 0, 3, 2, 4]
    neither = looked_at(found, "speed", "neither")
    assert list(neither["part"]) == ["", "lowest", "median", "highest", ""]
    assert list(neither.index) == [1, 2, 3, 0, 4]


@pytest.mark.parametrize(
    ("values", "statuses", "median"),
    [
        ([3.0, 1.0, 2.0], "done done done", 2),
        ([1.0, 2.0, 9.0, 3.0], "done done done done", 1),
        ([np.nan, 4.0], "failed done", 1),
        ([np.nan, 4.0, 5.0], "failed done done", 1),
        ([np.nan, np.nan], "failed done", None),
    ],
)
def test_the_median_trial_is_done(
    values: list[float], statuses: str, median: int | None
) -> None:
    ids = [f"trial {place}" for place in range(len(values))]
    table = pd.DataFrame({"trial_id": ids, "status": statuses.split(), "speed": values})
    assert median_trial(table, "speed") == ("" if median is None else ids[median])


def test_the_trials_of_a_point_are_its_stored_ones() -> None:
    study = plotted.study("small")
    results = study.store.folder.parent
    point = str(study.points.index[1])
    answer = told(results, "trials", ("study", "small"), ("point", point))
    own = study.trials[study.trials["point"] == point].set_index("trial_id")
    assert {one["trial_id"] for one in answer["rows"]} == set(own.index)
    for row in answer["rows"]:
        assert row["value"] == own.loc[row["trial_id"], "speed"]
        assert row["replay"] == f"sweep replay small {row['trial_id']}"
    with pytest.raises(ChoiceError, match="unknown point"):
        told(results, "trials", ("study", "small"), ("point", "x"))


def test_failures_are_grouped_and_come_first(tmp_path: Path) -> None:
    launched(IMPOSSIBLE, tmp_path)
    state = told(tmp_path, "state", ("study", "small"))
    (cause,) = state["causes"]
    assert (cause["status"], cause["trials"], state["counts"]) == (
        "failed",
        6,
        {"failed": 6},
    )
    assert state["strip"]["marks"] == [1] * 6
    rows = told(tmp_path, "trials", ("study", "small"))["rows"]
    assert {row["error"] for row in rows} == {cause["cause"]}
    with pytest.raises(UserError, match="no trial is done"):
        told(tmp_path, "figure", ("study", "small"))


def test_a_launch_is_seen_while_it_runs_and_only_what_is_new_is_read(
    tmp_path: Path,
) -> None:
    study = launched(SMALL, tmp_path)
    watched = Watched(tmp_path)
    ask = site_of(watched).answers["state"]
    first = ask([("study", "small")])
    same = ask([("study", "small"), ("seen", first["revision"])])
    assert same == {"revision": first["revision"], "running": []}
    with Lock(place_of(study.store.folder, tmp_path)):
        assert len(ask([("study", "small")])["running"]) == 1
    launched(SMALL.replace("replicates: 3", "replicates: 4"), tmp_path)
    more = ask([("study", "small"), ("seen", first["revision"])])
    assert more["revision"] != first["revision"]
    assert more["counts"] == {"done": 8}


def test_looking_writes_nothing(tmp_path: Path) -> None:
    launched(SMALL, tmp_path)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    for question in ("studies", "state", "points", "trials", "figure", "file"):
        pairs = [] if question == "studies" else [("study", "small")]
        told(tmp_path, question, *pairs)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_the_spec_of_a_trial_launches_it_again() -> None:
    study = plotted.study("small")
    row = study.trials.iloc[-1]
    pairs = [("study", "small"), ("trial", str(row["trial_id"]))]
    answer = told(study.store.folder.parent, "spec", *pairs)
    again = study_of(answer["yaml"])
    assert (again.name, again.trials_per_point) == ("small", 3)
    assert (answer["point"], answer["replicate"]) == (row["point"], 2)


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([], 'lacks the key "study"'),
        ([("study", "small"), ("stduy", "a")], "unknown key of the question"),
        ([("study", "a"), ("study", "b")], "study occurs 2 times; allowed: once"),
        ([("study", "a"), ("page", "-1")], "an integer from 0"),
        ([("study", "a"), ("page", "9" * 30)], "an integer from 0"),
        ([("study", "a"), ("half", "maybe")], "allowed: yes, no"),
        ([("study", "a" * (MOST_CHARACTERS + 1))], "characters"),
        ([("study", "a"), *[("metric", "x")] * (MOST_VALUES + 1)], "more than 100"),
    ],
)
def test_what_is_no_question_is_refused(
    pairs: list[tuple[str, str]], words: str
) -> None:
    with pytest.raises(ChoiceError, match=words):
        read(AskPoints, pairs)


@pytest.mark.parametrize("question", sorted(QUESTIONS.keys() - {"studies"}))
@pytest.mark.parametrize("name", ["../up", "/etc", "a//b", "", "small\x00", "lacking"])
def test_a_name_leads_nowhere_else(question: str, name: str, tmp_path: Path) -> None:
    pairs = [("study", name), *([("trial", "a")] if question == "spec" else [])]
    with pytest.raises(UserError):
        told(tmp_path, question, *pairs)


def test_a_narrow_study_has_the_means_of_the_whole(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    narrow = StoredStudy("small", tmp_path).narrow(["speed"])
    names = ["speed", "speed_mean"]
    assert narrow.means(names).equals(study.means(names))
    assert (narrow.units["speed"], narrow.distributions) == (
        study.units["speed"],
        study.distributions,
    )
    chosen = narrow.where("n=12", "separation_weight > 0.6")
    assert len(chosen.trials) == 3
    assert "dispersion" not in narrow.trials


def test_a_study_without_a_done_trial_has_one_reason_for_no_figure(
    tmp_path: Path,
) -> None:
    """Not one a kind of figure."""
    study = launched(SMALL, tmp_path)
    for part in study.store.current_parts():
        study.store.discard(part)
    with pytest.raises(ChoiceError) as refused:
        told(tmp_path, "figure", ("study", "small"))
    assert refused.value.reason == "no trial is done, so there is nothing to draw"
