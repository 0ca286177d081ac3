"""The views beside figures: two sides compared, the report of a search, the scorecard.
Their numbers are those of the commands below them.
"""

import base64
import json
import shlex
from pathlib import Path
from typing import Any

import pytest

from sweep.cli.progress import ProgressBar
from sweep.errors import ChoiceError, StoreError, UserError
from sweep.explorer.asking import AskComparison, read
from sweep.explorer.compared import comparison
from sweep.explorer.site import address, site_of
from sweep.explorer.watching import Watched
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.spec.study_folder import SCORECARD
from sweep.workers.executors import Serial
from tests import plotted
from tests.cases import slow_but
from tests.commands import sweep
from tests.explorer.test_answers import printed, told
from tests.publications import PUBLISHED, SPEC, experiments
from tests.studies import SMALL, launched

SIDES = {
    "grid": ("grid:borders=torus", "grid:borders=bounded"),
    "drawn": ("drawn:n=6", "drawn:n=12"),
    "ablated": ("ablated:as_run", "ablated:as_written"),
    "small": ("small:separation_weight=0.5", "small:separation_weight=1"),
    "searched": ("searched:phase=search", "searched:phase=held_out"),
}
ROUNDED = 1e-9
"""Marks are written with ten decimals."""


def results(*names: str) -> Path:
    """The folder with these studies of `plotted`."""
    folders = {plotted.study(name).store.folder.parent for name in names}
    (folder,) = folders
    assert isinstance(folder, Path)
    return folder


CHOICES: dict[str, list[tuple[str, str]]] = {
    "grid": [],
    "drawn": [("half", "yes")],
    "ablated": [("margin", "0.25"), ("metric", "speed"), ("confidence", "0.9")],
    "small": [("together", "bonferroni")],
    "searched": [("metric", "speed")],
}


@pytest.mark.parametrize("name", slow_but(["drawn", "ablated", "small"], SIDES))
def test_every_number_of_a_comparison_is_that_of_sweep_compare(name: str) -> None:
    folder, (a, b) = results(name), SIDES[name]
    answer = told(folder, "compare", ("a", a), ("b", b), *CHOICES[name])
    assert answer["facts"] == json.loads(printed(answer["command"]))
    rows = answer["facts"]["rows"]
    assert answer["total"] == len(rows) == len(answer["cells"]) == len(answer["behind"])
    for row, cells in zip(rows, answer["cells"], strict=True):
        assert len(cells) == len(answer["titles"])
        assert cells[-1] == row["verdict"]


def test_the_words_of_a_comparison_are_those_of_sweep_compare() -> None:
    folder, (a, b) = results("small"), SIDES["small"]
    answer = told(folder, "compare", ("a", a), ("b", b))
    text = sweep(folder.parent, *shlex.split(answer["command"])[1:]).stdout
    assert all(line in text for line in (*answer["notes"], *answer["heading"]))
    assert all(cell in text for cells in answer["cells"] for cell in cells)


@pytest.mark.parametrize("name", slow_but(["grid", "ablated"], SIDES))
def test_behind_a_row_are_the_trials_of_both_sides(name: str) -> None:
    """As many as the row says, all with its settings."""
    answers = site_of(Watched(results(name))).answers
    sides = dict(zip("ab", SIDES[name], strict=True))
    answer = answers["compare"]([*sides.items(), *CHOICES[name]])
    rows = [*zip(answer["facts"]["rows"], answer["behind"], strict=True)]
    for row, behind in (rows[0], rows[-1]):
        for side in sides:
            pairs = [("study", name), ("point", behind[side])]
            trials = answers["trials"]([*pairs, ("metric", behind["metric"])])
            assert trials["total"] == row[f"trials_{side}"]
            (settings,) = trials["settings"].values()
            for one in settings.keys() & set(answer["settings"]):
                assert settings[one] == pytest.approx(row[one], rel=ROUNDED)


def test_a_comparison_is_read_again_only_when_something_was_stored(
    tmp_path: Path,
) -> None:
    launched(SMALL, tmp_path)
    asked = [("a", "small:separation_weight=0.5"), ("b", "small:separation_weight=1")]
    first = told(tmp_path, "compare", *asked)
    seen = ("seen", first["revision"])
    assert told(tmp_path, "compare", *asked, seen) == {"revision": seen[1]}
    launched(SMALL.replace("replicates: 3", "replicates: 4"), tmp_path)
    again = told(tmp_path, "compare", *asked, seen)
    assert {row["trials_a"] for row in again["facts"]["rows"]} == {4}


def test_an_address_asks_for_what_it_was_made_of() -> None:
    asked = AskComparison("a:n=5,map=empty", "b", ("speed",), half=True, margin=0.125)
    told_by = address(asked)
    assert told_by == (
        "a=a%3An%3D5%2Cmap%3Dempty&b=b&metric=speed&half=yes&margin=0.125"
    )
    assert address(AskComparison("a", "b")) == "a=a&b=b"


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([("b", "grid:borders=bonded")], 'did you mean "bounded"'),
        ([("b", "grid:borders=torus")], "identical trials"),
        ([("b", "gird")], "gird"),
        ([("margin", "wide")], 'margin is "wide"; allowed: a finite number'),
        ([("margin", "inf")], "allowed: a finite number"),
        ([("margin", "-1"), ("metric", "speed")], "allowed: a number above 0"),
        ([("margin", "1")], "a margin is in the unit of a single metric"),
        ([("confidence", "2")], "allowed: from 0.5 to below 1"),
        ([("together", "hulm")], 'did you mean "holm"'),
        ([("metric", "sped")], 'did you mean "speed"'),
    ],
)
def test_what_cannot_be_compared_is_refused(
    pairs: list[tuple[str, str]], words: str
) -> None:
    first, second = SIDES["grid"]
    asked = {"a": first, "b": second, **dict(pairs)}
    with pytest.raises(UserError, match=words):
        comparison(Watched(results("grid")), read(AskComparison, list(asked.items())))


@pytest.fixture(scope="module")
def report() -> tuple[dict[str, Any], dict[str, Any], str]:
    """What the page is told of a search, and what its command prints, in JSON and as
    text.
    """
    folder = results("searched")
    answer = told(folder, "search", ("study", "searched"))
    words = shlex.split(answer["command"])[1:]
    text = sweep(folder.parent, *words, "--quiet").stdout
    return answer, json.loads(printed(f"{answer['command']} --quiet")), text


def test_the_report_of_a_search_is_that_of_its_command(
    report: tuple[dict[str, Any], dict[str, Any], str],
) -> None:
    answer, facts, text = report
    said = [answer["searched"], answer["best"], *answer["said"]]
    assert all(part in text for part in said)
    assert answer["notes"] == facts["warnings"]
    for table in answer["tables"]:
        assert table["note"] in text
        assert len(table["rows"]) == len(table["points"]) > 0
        for cells in table["rows"]:
            assert all(cell in text for cell in cells)


def test_behind_a_row_of_a_report_are_the_held_out_trials_of_whom_it_names(
    report: tuple[dict[str, Any], dict[str, Any], str],
) -> None:
    seen: dict[str, set[str]] = {}
    for table in report[0]["tables"]:
        named = 2 if "minus" in table["titles"] else 1
        for row, behind in zip(table["rows"], table["points"], strict=True):
            points = behind.split()
            assert all(one.startswith("held_out:") for one in points)
            for name, point in zip(row[:named], points, strict=True):
                seen.setdefault(name, set()).add(point)
    assert seen.keys() == {"3", "7", "usual"}
    assert len(set.union(*seen.values())) == len(seen)


def test_the_marks_of_a_history_are_its_candidates_and_winners(
    report: tuple[dict[str, Any], dict[str, Any], str],
) -> None:
    _, facts, _ = report
    figure = told(results("searched"), "figure", ("study", "searched"))
    assert (figure["kind"], figure["metrics"]) == ("history", [])
    for panel in figure["panels"]:
        column = panel["y"]["name"]
        held = [*facts["winners"], *facts["references"]]
        wanted = [one[column] for one in facts["candidates"]]
        wanted += [one["held_out"] for one in held if one["objective"] == column]
        marks = _marks(panel)
        assert [one["y"] for one in marks] == pytest.approx(wanted, abs=ROUNDED)
        assert all(one["point"] for one in marks)


def test_the_marks_of_a_front_lead_to_its_trials(
    report: tuple[dict[str, Any], dict[str, Any], str],
) -> None:
    """Held-out estimates have the trials of that phase, candidates those of theirs."""
    _, facts, _ = report
    asked = [("study", "searched")]
    figure = told(results("searched"), "figure", *asked, ("kind", "front"))
    (panel,) = figure["panels"]
    marks, candidates = _marks(panel), facts["candidates"]
    for mark, one in zip(marks[: len(candidates)], candidates, strict=True):
        place = (one[panel["x"]["name"]], one[panel["y"]["name"]])
        assert (mark["x"], mark["y"]) == pytest.approx(place, abs=ROUNDED)
        assert mark["n"] == one["trials"]
    judged = marks[len(candidates) :]
    assert len(judged) == len(facts["front"]) + 1
    for mark in judged:
        trials = told(results("searched"), "trials", *asked, ("point", mark["point"]))
        assert trials["total"] == mark["n"] == 3
        (settings,) = trials["settings"].values()
        assert settings["phase"] == "held_out"


def _marks(panel: dict[str, Any]) -> list[dict[str, Any]]:
    columns, data = panel["marks"]["columns"], panel["marks"]["data"]
    return [dict(zip(columns, row, strict=True)) for row in data]


def test_a_study_that_is_no_search_has_no_report() -> None:
    with pytest.raises(ChoiceError, match="not a search"):
        told(results("small"), "search", ("study", "small"))


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a tiny publication, run, drawn and judged."""
    folder = tmp_path_factory.mktemp("judged")
    experiments(folder)
    publications = read_all(folder / "experiments", quick=False, only=())
    reproduce(publications, folder / "results", Serial(), ProgressBar)
    return folder / "results"


def test_a_claim_leads_to_its_figure_and_its_trials(judged: Path) -> None:
    content = json.loads((judged / SCORECARD[-1]).read_text("utf-8"))
    answer = told(judged, "scorecard")
    assert told(judged, "studies")["scorecards"] == answer["scales"] == ["full"]
    for row, given in zip(answer["rows"], content["rows"], strict=True):
        same = ("id", "study", "says", "status", "reason", "trials")
        assert [row[name] for name in same] == [given[name] for name in same]
    first, untestable = answer["rows"]
    assert untestable["behind"] == []
    html = (judged / SCORECARD[0]).read_text("utf-8")
    assert first["ours"] in html
    (side,) = first["behind"]
    pairs = [("study", side["study"]), ("where", side["where"])]
    assert told(judged, "trials", *pairs)["total"] == first["trials"]
    shown = told(judged, "picture", ("study", "tiny"), ("claim", first["id"]))
    stored = judged / content["rows"][0]["picture"]
    assert base64.b64decode(shown["png"]) == stored.read_bytes()
    with pytest.raises(ChoiceError, match="no figure of claim"):
        told(judged, "picture", ("study", "tiny"), ("claim", untestable["id"]))


def test_a_claim_about_an_infinite_setting_leads_to_its_trials(tmp_path: Path) -> None:
    """JSON has no infinite number."""
    experiments(
        tmp_path,
        spec=SPEC.replace(
            "  separation_weight", "  obstacle_range: [10, .inf]\n  separation_weight"
        ),
        published=PUBLISHED.replace("for: {", "for: {obstacle_range: .inf, "),
    )
    publications = read_all(tmp_path / "experiments", quick=False, only=())
    results = tmp_path / "results"
    reproduce(publications, results, Serial(), ProgressBar)
    first, _ = told(results, "scorecard")["rows"]
    (side,) = first["behind"]
    assert "obstacle_range=inf" in side["where"]
    pairs = [("study", side["study"]), ("where", side["where"])]
    assert told(results, "trials", *pairs)["total"] == first["trials"] == 8


def _edited(judged: Path, folder: Path, **changes: object) -> Path:
    """A folder with the scorecard, whose first row is changed; None takes a key out."""
    content = json.loads((judged / SCORECARD[-1]).read_text("utf-8"))
    row = {**content["rows"][0], **changes}
    content["rows"][0] = {
        name: value for name, value in row.items() if value is not None
    }
    (folder / SCORECARD[-1]).write_text(json.dumps(content), "utf-8")
    return folder


def test_a_scorecard_of_an_earlier_version_names_no_trials(
    judged: Path, tmp_path: Path
) -> None:
    folder = _edited(judged, tmp_path, picture=None, behind=None)
    first = told(folder, "scorecard")["rows"][0]
    assert (first["behind"], first["picture"]) == ([], False)


@pytest.mark.parametrize("path", ["../secret.png", "/etc/passwd", "scorecard.json"])
def test_a_scorecard_shows_no_other_file(
    path: str, judged: Path, tmp_path: Path
) -> None:
    (tmp_path / "secret.png").write_bytes(b"secret")
    (tmp_path / "results").mkdir()
    folder = _edited(judged, tmp_path / "results", picture=path)
    with pytest.raises(StoreError, match="is not a figure below"):
        told(folder, "picture", ("study", "tiny"), ("claim", "start-speed"))


@pytest.mark.parametrize(
    ("text", "words"),
    [("[]", "the required entries"), ("{", "reproduce again"), ("", "reproduce")],
)
def test_a_damaged_scorecard_is_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / SCORECARD[-1]).write_text(text, "utf-8")
    with pytest.raises(StoreError, match=words):
        told(tmp_path, "scorecard")
    with pytest.raises(StoreError, match="run sweep reproduce"):
        told(tmp_path, "scorecard", ("scale", "quick"))
    with pytest.raises(ChoiceError, match='did you mean "quick"'):
        told(tmp_path, "scorecard", ("scale", "quik"))


@pytest.mark.parametrize(
    ("words", "told_by"),
    [
        (("small", "--margin", "1"), "needs two sides; use sweep show A B"),
        (("small", "grid", "--to", "x.html"), "a file shows one study"),
        (("small", "grid", "--title", "x"), "needs --to FILE.html"),
        (("small", "grid", "--metric", "sped"), 'did you mean "speed"'),
        (("small", "gird"), "gird"),
        (("small", "small"), "identical trials"),
    ],
)
def test_what_the_command_cannot_show_is_said_before_it_serves(
    words: tuple[str, ...], told_by: str
) -> None:
    folder = results("small", "grid").parent
    where = ("--results", str(results("small")), "--no-open")
    done = sweep(folder, "show", *words, *where)
    assert done.returncode != 0
    assert told_by in done.stderr
