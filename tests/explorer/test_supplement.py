"""A study as one file for readers: its numbers are those of the table, its runs those
that are stored, and what cannot be is refused before any trial runs.
"""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep.explorer.supplement as supplement
from sweep.errors import ChoiceError, StoreError, UserError
from sweep.explorer import supplement_starts
from sweep.explorer.publishing import PaperTexts, publication, read_cff
from sweep.explorer.supplement import SupplementChoice, planned
from sweep.explorer.supplement_figure import form_of
from sweep.explorer.supplement_room import MOST_BYTES, RunLength, most_frames
from sweep.figures.selection import select
from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.explorer.supplements import FLOWN, content_of, page_of
from tests.replays.test_verify import next_float, rewrite
from tests.searches import edited
from tests.studies import COVERING, DERIVING, IMPOSSIBLE, SMALL, launched
from tests.web.scripts import frames_of

EVIL = "</script><script>alert(1)</script>"
FAILING = edited(
    IMPOSSIBLE,
    ("n_obstacles: 1, ", ""),
    ("separation_weight: [0.5, 1]", "n_obstacles: [0, 1]"),
)
"""Of one of its points every trial raises."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with results, which tests only read."""
    folder = tmp_path_factory.mktemp("supplement")
    for spec in (FLOWN, COVERING):
        launched(spec, folder / "results")
    return folder


@pytest.fixture(scope="module")
def study(folder: Path) -> StoredStudy:
    return StoredStudy("small", folder / "results")


@pytest.fixture(scope="module")
def page(study: StoredStudy) -> bytes:
    return page_of(study)


def plan_of(study: StoredStudy, **choice: Any) -> supplement.Supplement:
    return planned(study, SupplementChoice(**choice), PaperTexts())


@pytest.mark.parametrize("over", ["last", "half"])
def test_every_number_is_that_of_the_table(
    folder: Path, study: StoredStudy, over: str
) -> None:
    table = sweep(
        folder, "table", "small", "--metric", "speed", "--json", "--over", over
    )
    plan = plan_of(study, half=over == "half")
    assert plan.data["rows"] == json.loads(table.stdout)


def test_the_median_trial_of_each_point_is_behind_its_mark(
    study: StoredStudy, page: bytes
) -> None:
    content = content_of(page)
    weights = [row["separation_weight"] for row in content["rows"]]
    assert weights == [0.5, 1, 2]
    assert [point["runs"] for point in content["points"]] == [[0], [1], [2]]
    assert content["points"][0]["words"] == "separation weight 0.5"
    for weight, run in zip(weights, content["runs"], strict=True):
        trials = study.where(separation_weight=weight).trials.set_index("trial_id")
        ordered = trials["speed"].sort_values()
        assert run["trial"] == ordered.index[1]  # the lower one in the middle of four
        assert run["value"] == run["stored"] == run["values"][-1] == ordered.iloc[1]
        assert run["replicate"] == trials.loc[run["trial"], "replicate"]


def test_a_run_has_the_frames_of_the_trial(study: StoredStudy, page: bytes) -> None:
    run = content_of(page)["runs"][2]
    job = study.job(study.trial(run["trial"]))
    n, frames = int(job.settings["n"]), frames_of(run)
    size = 32 + 5 * n + -5 * n % 4
    assert run["steps"] == list(range(61))
    assert len(frames) == 61 * size
    assert len(run["frames"]) < 0.9 * len(frames)
    heads = [struct.unpack_from("<4s3I", frames, at * size) for at in range(61)]
    assert heads == [(b"BSF1", 0, step, n) for step in range(61)]
    series = study.series[study.series["trial_id"] == run["trial"]]
    assert [run["values"][frame] for frame in series["frame"]] == series[
        "speed"
    ].tolist()


def test_trials_at_the_ends_can_be_chosen_too(folder: Path, study: StoredStudy) -> None:
    covering = StoredStudy("covering", folder / "results")
    worst = plan_of(
        covering, metric="coverage", trials=("worst", "lowest", "highest")
    ).data["runs"]
    assert {run["roles"] for run in worst} == {("worst", "lowest"), ("highest",)}
    runs = plan_of(study, trials=("lowest", "median", "highest")).data["runs"]
    assert len(runs) == 9
    found = [run["roles"] for run in runs[:3]]
    assert found == [("lowest",), ("median",), ("highest",)]
    values = [run["value"] for run in runs[:3]]
    assert values == sorted(values)
    trials = study.where(separation_weight=0.5).trials
    assert (values[0], values[2]) == (trials["speed"].min(), trials["speed"].max())


def test_one_trial_that_differs_in_one_bit_is_refused(tmp_path: Path) -> None:
    stored = launched(SMALL, tmp_path)
    worst = stored.trials.sort_values("speed")["trial_id"].iloc[0]
    first = stored.trials["trial_id"].iloc[0]
    changed = rewrite(stored, "series", "speed", next_float)
    roles = ("lowest", "median", "highest")
    plan = plan_of(changed, trials=roles)
    assert {worst, first} <= {run["trial"] for run in plan.data["runs"]}
    with pytest.raises(StoreError, match=r"1 of 6 trials, .* no page .*\(1 ulp\)"):
        page_of(changed, trials=roles)


def test_trials_of_other_code_are_refused_before_any_runs(
    study: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("kernels.identity._flight_stamp", lambda: "other code")
    with pytest.raises(StoreError, match="computed by other code"):
        plan_of(study)


def test_a_trial_that_fails_here_is_refused(
    study: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_job: object) -> None:
        raise ValueError("no room")

    monkeypatch.setattr("sweep.explorer.supplement_runs.simulate", fail)
    with pytest.raises(StoreError, match=r"shown, because the trial fails: .*no room"):
        page_of(study)


def test_a_point_whose_trials_failed_has_none_and_says_so(tmp_path: Path) -> None:
    content = content_of(page_of(launched(FAILING, tmp_path)))
    whole, failed = content["points"]
    assert (whole["runs"], whole["why"]) == ([0], "")
    assert failed["runs"] == []
    assert failed["why"] == "No trial of this point is done (3 failed)."
    assert content["rows"][1]["speed"] is None


def test_what_a_study_does_not_have_is_refused(
    study: StoredStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deriving = launched(DERIVING, tmp_path)
    for stored, choice, said in (
        (study, {"metric": "sped"}, 'unknown metric "sped"; did you mean "speed"'),
        (study, {"x": "n"}, 'unknown varied parameter "n"'),
        (study, {"by": "separation_weight", "x": "separation_weight"}, "axis already"),
        (study, {"where": ("separation_weight=7",)}, "separation_weight = 7"),
        (study, {"trials": ("middle",)}, 'unknown choice of trials "middle"'),
        (deriving, {"metric": "loss", "trials": ("best",)}, "loss is derived"),
        (study, {"trials": ("worst",)}, "speed declares no direction of better"),
        (launched(IMPOSSIBLE, tmp_path / "failed"), {}, "no trial is done"),
    ):
        with pytest.raises(ChoiceError, match=said):
            plan_of(stored, **choice)
    monkeypatch.setattr(supplement, "MOST_POINTS", 2)
    with pytest.raises(ChoiceError, match=r"3 points; a page shows up to 2; .*--where"):
        plan_of(study)
    assert len(plan_of(study, where=("separation_weight >= 1",)).orders) == 2


FORMS = [
    ("separation_weight: [0.5, 1, 2]", "", ("lines", "separation_weight", "", "")),
    (
        "separation_weight: [0.5, 1, 2]\n  alignment_weight: [0, 1]",
        "",
        ("lines", "separation_weight", "", "alignment_weight"),
    ),
    (
        "separation_weight: [0, 1, 2, 3]\n  alignment_weight: [0, 1, 2, 3]",
        "",
        ("cells", "separation_weight", "alignment_weight", ""),
    ),
    (
        "separation_weight: [0, 1, 2, 3]\n  alignment_weight: [0, 1, 2, 3]",
        "alignment_weight",
        ("lines", "separation_weight", "", "alignment_weight"),
    ),
    ("borders: [bounded, torus]", "", ("rows", "", "", "")),
    (
        "separation_weight: [0, 1]\n  alignment_weight: [0, 1]\n  n: [3, 4]",
        "",
        ("rows", "", "", ""),
    ),
    (
        "corner:\n    sample: lhs\n    points: 4\n"
        "    separation_weight: {uniform: [0, 2]}\n"
        "    alignment_weight: {uniform: [0, 2]}",
        "",
        ("points", "separation_weight", "", ""),
    ),
]


@pytest.mark.parametrize(("axes", "by", "form"), FORMS)
def test_the_form_follows_from_what_varies(
    axes: str, by: str, form: tuple[str, ...], tmp_path: Path
) -> None:
    own = "" if "n:" in axes else ", n: 4"
    spec = edited(
        SMALL,
        ("separation_weight: [0.5, 1]", axes),
        ("fixed: {n: 12, steps: 9}", f"fixed: {{steps: 1{own}}}"),
        ("replicates: 3", "replicates: 1"),
        ("record: {series: [speed], every: 2}", "record: {metrics: [speed]}"),
    )
    found = form_of(select(launched(spec, tmp_path)), "", by)
    assert (found.form, found.x, found.y, found.by) == form


def test_twenty_five_points_of_a_hundred_boids_have_all_their_frames() -> None:
    runs = [RunLength(100, 600)] * 25
    room = MOST_BYTES - 400_000
    assert most_frames(runs, 601, room) == 601
    assert sum(601 * run.frame_bytes for run in runs) < 12 * 2**20
    assert (runs[0].every(601), runs[0].every(600), runs[0].every(301)) == (1, 2, 2)


@pytest.mark.parametrize("steps", [1, 9, 60, 599, 600, 601, 3600])
@pytest.mark.parametrize("most", [2, 3, 7, 100, 601])
def test_a_run_has_no_more_frames_than_it_may(steps: int, most: int) -> None:
    every = RunLength(1, steps).every(most)
    frames = len({*range(0, steps, every), steps})
    assert frames <= most
    assert every == 1 or len({*range(0, steps, every - 1), steps}) > most


def test_runs_are_thinned_where_the_page_would_be_too_large(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    covering = StoredStudy("covering", folder / "results")
    small = len(page_of(covering, frames=2))
    whole = len(page_of(covering))
    most = (small + whole) // 2
    monkeypatch.setattr(supplement, "MOST_BYTES", most)
    monkeypatch.setattr("sweep.explorer.supplement_room.FEWEST_FRAMES", 3)
    thinned = page_of(covering)
    assert small < len(thinned) <= most
    runs = content_of(thinned)["runs"]
    assert all(run["every"] > 1 and run["steps"][-1] == 20 for run in runs)
    monkeypatch.setattr("sweep.explorer.supplement_room.FEWEST_FRAMES", 100)
    with pytest.raises(ChoiceError, match=r"2 runs with 100 frames .* fewer points"):
        plan_of(covering)


def test_worlds_that_are_equal_are_stored_once(
    folder: Path, study: StoredStudy, page: bytes
) -> None:
    content = content_of(page)
    for run in content["runs"]:
        obstacles = study.world(run["trial"]).obstacles.tolist()
        assert content["scenes"][run["scene"]]["obstacles"] == obstacles
    covering = StoredStudy("covering", folder / "results")
    data = plan_of(covering, trials=("lowest", "highest")).data
    assert len(data["scenes"]) == 1
    assert {run["scene"] for run in data["runs"]} == {0}


def test_no_text_in_a_supplement_becomes_an_element(tmp_path: Path) -> None:
    stored = launched(f"# {EVIL}\n{SMALL}", tmp_path)
    texts = publication(EVIL, (EVIL,), "10.1000/<script>", EVIL, EVIL)
    page = page_of(stored, texts)
    assert page.decode().count("<script") == 2
    assert b"<script>alert" not in page
    content = content_of(page)
    front = content["front"]
    assert content["spec"].startswith(f"# {EVIL}")
    assert front["title"] == front["caption"] == front["licence"] == EVIL
    assert front["authors"] == [EVIL]


def test_the_page_says_how_to_cite_it_and_run_it_again(page: bytes) -> None:
    front = content_of(page)["front"]
    assert front["run"][1:] == ["sweep launch spec.yaml", "sweep view small"]
    assert front["title"] == "Study small"
    assert front["licence"].startswith("not stated")
    assert len(front["cite"]) == 3
    assert "sha256:" in front["cite"][-1]
    assert dict(front["origin"])["Study"] == "small: 12 trials (12 done)"


CFF = """
cff-version: 1.2.0
title: Flocks
authors:
  - {given-names: Ada, family-names: Byron}
  - {name: The flock}
doi: https://doi.org/10.1000/182
license: CC-BY-4.0
abstract: They fly.
keywords: [boids]
"""


def test_texts_come_from_a_citation_file_and_options_go_first(tmp_path: Path) -> None:
    path = tmp_path / "CITATION.cff"
    path.write_text(CFF)
    known = read_cff(path)
    assert known == PaperTexts(
        "Flocks", ("Ada Byron", "The flock"), "10.1000/182", "CC-BY-4.0", "They fly."
    )
    assert (
        known.reference == "Ada Byron, The flock: Flocks. https://doi.org/10.1000/182"
    )
    mixed = publication(title="Swarms").or_else(known)
    assert mixed == known._replace(title="Swarms")
    without = CFF.replace("{name:", "{orcid:")
    for wrong in (CFF.replace("10.1000/182", "eleven"), without):
        path.write_text(wrong)
        with pytest.raises(UserError, match=r"DOI|an author needs a name"):
            read_cff(path)


def test_the_command_writes_the_file_once(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "flocks.html"
    asked = ("show", "small", "--to", str(path), "--title", "Flocks", "--frames", "7")
    done = sweep(folder, *asked)
    assert (done.returncode, done.stdout) == (0, f"{path}\n")
    assert "0 of 3 runs" in done.stderr
    content = content_of(path.read_bytes())
    assert content["front"]["title"] == "Flocks"
    assert content["runs"][0]["steps"] == list(range(0, 61, 10))
    again = sweep(folder, *asked)
    assert again.returncode == 2
    assert "exists already; --force replaces it" in again.stderr
    other = sweep(folder, "show", "small", "--to", str(tmp_path / "flocks.pdf"))
    assert 'unknown kind of file ".pdf"' in other.stderr
    assert np.array_equal([one.name for one in tmp_path.iterdir()], ["flocks.html"])


@pytest.mark.parametrize(
    ("metric", "words"),
    [
        ("flock_count", "flock_count is measured on processors only; allowed: speed, "),
        ("size", "size is derived from further metrics; allowed: speed, "),
    ],
)
def test_metrics_that_a_page_cannot_compute_are_refused(
    tmp_path: Path, metric: str, words: str
) -> None:
    text = DERIVING.replace("metrics: [dispersion]", "metrics: [flock_count]")
    study = launched(text.replace("dispersion", "flock_radius"), tmp_path)
    with pytest.raises(ChoiceError) as raised:
        plan_of(study, metric=metric, compute=True)
    assert "without --compute" in str(raised.value)
    assert words in str(raised.value)


def test_a_page_computes_nothing_without_the_packages(
    study: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = supplement_starts.find_spec
    monkeypatch.setattr(
        supplement_starts,
        "find_spec",
        lambda name: None if name == "ziglang" else found(name),
    )
    with pytest.raises(ChoiceError) as raised:
        plan_of(study, compute=True)
    assert 'needs ziglang: pip install "boidsweep[wasm]"' in str(raised.value)


def test_a_page_that_computes_too_many_trials_is_refused(
    study: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supplement, "MOST_BYTES", 300_000)
    with pytest.raises(ChoiceError, match="select fewer points with --where"):
        page_of(study, compute=True, trials=("all",))
