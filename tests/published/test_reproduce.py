"""Reproductions from end to end: a tiny folder of
experiments, run, drawn and judged.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from sweep.cli.progress import ProgressBar
from sweep.errors import OutputError, SpecError
from sweep.published.publications import read_all
from sweep.published.reproducing import Outcome, reproduce
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.commands import sweep
from tests.publications import FIGURES, PUBLISHED, SPEC, experiments

BROKEN_TRIALS = SPEC.replace(
    "n: 40,", "n: 40, n_obstacles: 1, obstacle_radius: 5000, start_free: true,"
).replace("replicates: 8", "replicates: 1")


def reproduced(
    folder: Path, *, quick: bool = False, only: tuple[str, ...] = ()
) -> Outcome:
    """The outcome for the publications below `folder`, in this process."""
    publications = read_all(folder / "experiments", quick=quick, only=only)
    return reproduce(
        publications, folder / "results", Serial(), ProgressBar, quick=quick
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny publication, run, drawn and judged."""
    folder = tmp_path_factory.mktemp("whole")
    experiments(folder)
    reproduced(folder)
    return folder


@pytest.fixture
def judged(whole: Path, tmp_path: Path) -> Path:
    """A copy of it, to be changed."""
    return Path(shutil.copytree(whole, tmp_path, dirs_exist_ok=True))


def scorecard(folder: Path) -> dict[str, Any]:
    """What the page says to machines."""
    text = (folder / "results" / "scorecard.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def done(outcome: Outcome) -> tuple[int, int, int]:
    return outcome.new, outcome.drawn, outcome.up_to_date


def test_a_second_run_runs_and_draws_nothing_and_a_wrong_speed_fails(
    tmp_path: Path,
) -> None:
    """as_run starts at a mean speed of 0.765, and with start_speed 3 at 2.3."""
    experiments(tmp_path)
    first = reproduced(tmp_path)
    assert (done(first), first.whole) == ((16, 2, 0), True)
    assert first.statements == {"tiny": {"confirmed": 1, "not testable": 1}}
    pages = [
        (tmp_path / "results" / f"scorecard.{kind}").read_bytes()
        for kind in ("html", "md", "json")
    ]
    again = reproduced(tmp_path)
    assert done(again) == (0, 0, 2)
    assert pages == [
        (tmp_path / "results" / f"scorecard.{kind}").read_bytes()
        for kind in ("html", "md", "json")
    ]
    experiments(tmp_path, spec=SPEC.replace("steps: 6}", "steps: 6, start_speed: 3}"))
    wrong = reproduced(tmp_path)
    assert (done(wrong), wrong.whole) == ((16, 2, 0), True)
    assert wrong.statements == {"tiny": {"refuted": 1, "not testable": 1}}
    assert (
        "is completely outside the margin"
        in (tmp_path / "results" / "scorecard.md").read_text()
    )


def test_the_quick_scale_is_apart_and_says_so(tmp_path: Path) -> None:
    experiments(tmp_path)
    outcome = reproduced(tmp_path, quick=True)
    results = tmp_path / "results"
    assert done(outcome) == (6, 2, 0)
    assert [path.name for path in results.iterdir()] == ["quick"]
    assert "QUICK: FEW TRIALS" in (results / "quick" / "scorecard.html").read_text()
    assert "QUICK: FEW TRIALS" in (results / "quick" / "scorecard.md").read_text()
    full = reproduced(tmp_path)
    assert done(full) == (16, 2, 0)
    assert "QUICK" not in (results / "scorecard.html").read_text()


def test_a_figure_says_what_it_shows(whole: Path) -> None:
    path = whole / "results" / "figures" / "tiny" / "curves"
    with Image.open(path.with_suffix(".png")) as image:
        about = image.info
    assert (about["Study"], about["Trials"]) == ("tiny/small", "16")
    assert len(about["kernels_sha"]) == 64
    assert len(about["Spec hash"]) == 16
    assert b"Study: tiny/small" in path.with_suffix(".pdf").read_bytes()


@pytest.mark.parametrize(
    "change", slow_but(["figures.py", "png"], ["figures.py", "spec", "pdf", "png"])
)
def test_a_figure_is_drawn_again_when_its_inputs_change(
    judged: Path, change: str
) -> None:
    path = judged / "results" / "figures" / "tiny" / "curves"
    if change == "figures.py":
        experiments(judged, figures=FIGURES + "\n# another comment\n")
    elif change == "spec":
        experiments(judged, spec=SPEC.replace("replicates: 8", "replicates: 9"))
    elif change == "pdf":
        path.with_suffix(".pdf").unlink()
    else:
        path.with_suffix(".png").write_bytes(b"torn")
    outcome = reproduced(judged)
    # The picture of the claims shows other numbers for another spec only.
    assert (outcome.drawn, outcome.up_to_date) == (
        (2, 0) if change == "spec" else (1, 1)
    )


def test_a_figure_or_a_measure_that_fails_stops_nothing_else(tmp_path: Path) -> None:
    published = PUBLISHED.replace(
        "{mean: speed, frame: 0, for: {separation_weight: 1}}",
        "{call: broken, distribution: normal}",
    )
    others = (
        '"bad": Drawing(broken, ("small",), "nothing"),\n"none": Drawing(constant,'
        ' ("small",), "nothing"),\n'
    )
    failing = FIGURES.replace('"curves":', others + '"curves":')
    experiments(tmp_path, published, figures=failing)
    outcome = reproduced(tmp_path)
    assert outcome.failures == [
        "figure tiny/bad: RuntimeError: no idea",
        (
            "figure tiny/none: TypeError: the function must return a figure of"
            " matplotlib, not ndarray"
        ),
        "claim tiny/start-speed: broken: RuntimeError: no idea",
    ]
    assert (outcome.drawn, outcome.whole) == (1, False)
    assert outcome.statements == {"tiny": {"not testable": 2}}
    assert (
        "figure has not been drawn"
        in (tmp_path / "results" / "scorecard.html").read_text()
    )


def test_trials_that_fail_are_told_and_nothing_is_judged(tmp_path: Path) -> None:
    experiments(tmp_path, spec=BROKEN_TRIALS)
    outcome = reproduced(tmp_path)
    assert (outcome.not_done, outcome.whole) == (2, False)
    assert outcome.statements == {"tiny": {"not run": 1, "not testable": 1}}
    assert "2 not done" in outcome.summary()


def two_publications(folder: Path) -> None:
    """`tiny`, and the same as `other`."""
    other = experiments(folder) / "other"
    other.mkdir()
    for name, text in (
        ("small.yaml", SPEC),
        ("published.yaml", PUBLISHED),
        ("figures.py", FIGURES),
    ):
        (other / name).write_text(text.replace("tiny", "other"))


def test_only_some_are_run_and_the_page_names_the_others(tmp_path: Path) -> None:
    two_publications(tmp_path)
    outcome = reproduced(tmp_path, only=("other",))
    assert done(outcome) == (16, 2, 0)
    assert outcome.statements == {"other": {"confirmed": 1, "not testable": 1}}
    for name in ("scorecard.html", "scorecard.md"):
        page = (tmp_path / "results" / name).read_text()
        assert page.count("Not requested, and so not shown: tiny.") == 1
        assert page.count("tiny") == 1
        assert page.count("1 of 2 claims are counted and tested together") == 1
    content = scorecard(tmp_path)
    assert {row["study"] for row in content["rows"]} == {"other"}
    asked = {one["study"]: one["asked"] for one in content["documents"]}
    assert asked == {"other": True, "tiny": False}
    with pytest.raises(
        SpecError, match='unknown study folder "tny"; did you mean "tiny"'
    ):
        reproduced(tmp_path, only=("tny",))


def test_a_document_that_nobody_read_has_no_statement(tmp_path: Path) -> None:
    """All it says is known from memory, and counts as hypotheses."""
    unread = "    unverified: from memory\n    registered:"
    experiments(tmp_path, PUBLISHED.replace("    registered:", unread))
    outcome = reproduced(tmp_path)
    assert outcome.statements == {"tiny": {}}
    said = "statements of tiny: not compared with the publication"
    assert said in outcome.summary().splitlines()


def test_claims_of_another_document_change_no_verdict(judged: Path) -> None:
    alone = scorecard(judged)["rows"]
    two_publications(judged)
    reproduced(judged)
    both = scorecard(judged)["rows"]
    assert [row for row in both if row["study"] == "tiny"] == alone
    assert len(both) == 2 * len(alone)


def test_stored_trials_of_another_spec_are_not_tmp_path(tmp_path: Path) -> None:
    two_publications(tmp_path)
    assert [one["confirmed"] for one in reproduced(tmp_path).statements.values()] == [
        1,
        1,
    ]
    experiments(tmp_path, spec=SPEC.replace("steps: 6", "steps: 8"))
    reproduced(tmp_path, only=("other",))
    (found,) = (one for one in scorecard(tmp_path)["rows"] if one["trials"])
    assert (found["study"], found["status"]) == ("other", "confirmed")


def test_a_page_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    experiments(tmp_path)
    (tmp_path / "results" / "scorecard.html").mkdir(parents=True)
    with pytest.raises(
        OutputError,
        match=r"results: cannot write the page .*; trials and figures are stored",
    ):
        reproduced(tmp_path)


def test_the_command_exits_with_0_1_or_2(tmp_path: Path) -> None:
    experiments(tmp_path)
    fine = sweep(tmp_path, "reproduce", "--workers", "1", "--scale", "quick")
    assert fine.returncode == 0, fine.stderr
    assert "statements of tiny: 1 confirmed, 1 not testable" in fine.stderr
    experiments(
        tmp_path,
        figures=FIGURES.replace("return Figure", "raise RuntimeError(studies)  #"),
    )
    assert (
        sweep(tmp_path, "reproduce", "--workers", "1", "--scale", "quick").returncode
        == 1
    )
    experiments(tmp_path, PUBLISHED.replace("mean: speed,", "mean: sped,"))
    bad = sweep(tmp_path, "reproduce")
    assert bad.returncode == 2
    code, mistake = bad.stderr.splitlines()
    assert code == "this runs code: experiments/tiny/figures.py"
    assert mistake.startswith('tiny/published.yaml:14: unknown recorded series "sped"')
    assert not (tmp_path / "results" / "tiny").exists()
