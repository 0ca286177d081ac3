"""What version 0.4.0 stored is read, checked, extended and compared by this version.

`stored/0.4.0/README.md` says how the stores were made. What 0.4.0 said of them is
expected. Its ids covered one hash of all kernels. Where tests need its trials to be
those of a spec of today, they make ids as it did.
"""

import json
import shutil
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep
from sweep.methods.adaptive import stopping
from sweep.spec.study import Study
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.commands import sweep as command
from tests.earlier_stores import STORED, alike, columns_of, equal, long

EARLIER = STORED / "0.4.0"
THEN = "5812f667a47f7ad702e3a82a50f459d68577b5285317db45715c9360de123f8b"
"""The stamp of the kernels of 0.4.0."""
COMMIT = "fc235e49594c4a8c6433fe8b0e005962c06ebefa"
TRIALS = {"room": 8, "narrow": 39, "gains": 18}
CSV = sorted(EARLIER.glob("expected/*/*.csv"))
TABLES = [(path.parent.name, path.stem) for path in CSV]


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A folder with a copy of the stores and their specs."""
    for part in ("studies", "specs"):
        shutil.copytree(EARLIER / part, tmp_path / part)
    return tmp_path


def content_of_then(study: Study, *_: object) -> list[Any]:
    """What ids covered in 0.4.0, by the kernels of then."""
    record = asdict(study.record) | {
        "metrics": sorted(study.record.metrics),
        "series": sorted(study.record.series),
    }
    assert record.pop("derive") == ()  # keys that it did not know
    assert record.pop("last_states") is False
    assert record.pop("profiles") == ()
    assert record.pop("last_flocks") is False
    if not study.record.trajectories:
        del record["trajectories"]
    return [THEN, asdict(study.streams), record]


@pytest.fixture
def same_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trials have the ids, and say that they have the kernels, of 0.4.0."""
    monkeypatch.setattr("sweep.design.jobs.common_content", content_of_then)
    monkeypatch.setattr("sweep.store.provenance.kernels_sha", lambda: THEN)


def done(here: Path, *arguments: str) -> CompletedProcess[str]:
    """A command that has run with the copied stores as its results."""
    return command(here, *arguments, "--results", "studies")


def said(here: Path, *arguments: str) -> str:
    """What a command prints that succeeds."""
    ended = done(here, *arguments)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def launched(here: Path, study: str) -> str:
    """What a launch says at its end, or a search; diverged trials make the code 1."""
    verb = "search" if study == "gains" else "launch"
    ended = done(here, verb, f"specs/{study}.yaml")
    assert ended.returncode in (0, 1), ended.stderr
    return ended.stderr.splitlines()[-1]


def expected(study: str, name: str) -> str:
    return (EARLIER / "expected" / study / name).read_text()


def status_of_then(study: str) -> str:
    """Then a cause of failures stood there once for each trial, now it is counted."""
    facts, causes = [], {}
    lines = iter(expected(study, "status.txt").splitlines(keepends=True))
    for line in lines:
        if line.startswith("diverged: "):
            causes.setdefault(line, []).append(next(lines))
        else:
            facts.append(line)
    for cause, replays in causes.items():
        many = f" ({len(replays)} trials)" if len(replays) > 1 else ""
        facts += [cause.replace("\n", f"{many}\n"), replays[0]]
    return "".join(facts)


def exported(study: str, table: str) -> dict[str, list[str]]:
    """The columns of a table as 0.4.0 exported it."""
    return columns_of(EARLIER / "expected" / study / f"{table}.csv")


def loaded(here: Path, study: str) -> StoredStudy:
    return sweep.load(study, here / "studies")


def ended(here: Path, study: str, file: str) -> str:
    """What a command said then, but that intervals end where values do: each metric
    says that only now.
    """
    declared = loaded(here, study).distributions

    def cut(row: dict[str, Any]) -> dict[str, Any]:
        for place, bound in row.items():
            name, _, end = place.rpartition("_")
            column = name if name in declared else row.get("objective")
            known = name and end in ("low", "high") and bound is not None
            if not known or column not in declared:
                continue
            low, high = declared[column].support
            row[place] = max(bound, low) if end == "low" else min(bound, high)
        return row

    return json.dumps(json.loads(expected(study, file), object_hook=cut))


def edit(here: Path, study: str, old: str, new: str) -> None:
    """Put `new` in place of `old` in the spec of a study."""
    path = here / "specs" / f"{study}.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def unchanged(here: Path, study: str) -> None:
    """Assert that the rows of 0.4.0 are stored to the last bit.

    A trial that ran again would have taken other `seconds`.
    """
    for name, table in TABLES:
        if name == study:
            columns = exported(study, table)
            frame = long(loaded(here, study), table)
            then = frame[frame["trial_id"].isin(columns["trial_id"])]
            order = then["trial_id"].map(columns["trial_id"].index).to_numpy()
            equal(then.iloc[np.argsort(order, kind="stable")], columns)


def test_the_stores_are_those_of_0_4_0(here: Path) -> None:
    for study, count in TRIALS.items():
        stored = loaded(here, study)
        assert stored.provenance["kernels_sha"] == THEN
        assert stored.provenance["versions"]["boidsweep"] == "0.4.0"
        git = {"commit": COMMIT, "diff": "", "cut": 0, "untracked": {}}
        assert stored.provenance["git"] == git
        assert stored.statuses().total() == count
    tables = {table for _, table in TABLES}
    assert tables == {"trials", "series", "heatmaps", "trajectories"}
    parts = Counter(path.parent.parent.name for path in here.glob("studies/*/parts/*"))
    assert parts == {"room": 2, "narrow": 1, "gains": 1}


@pytest.mark.parametrize(("study", "table"), TABLES)
def test_every_value_is_read_as_then(here: Path, study: str, table: str) -> None:
    equal(long(loaded(here, study), table), exported(study, table))


@pytest.mark.parametrize("then", CSV, ids=map("-".join, TABLES))
def test_tables_are_exported_as_then(here: Path, then: Path) -> None:
    said(here, "export", then.parent.name, "--table", then.stem, "--to", "now.csv")
    found, wanted = pd.read_csv(here / "now.csv"), pd.read_csv(then)
    pd.testing.assert_frame_equal(found, wanted, check_exact=True)


def test_maps_ablations_and_the_rule_of_stopping_are_read(here: Path) -> None:
    room, narrow = loaded(here, "room"), loaded(here, "narrow")
    world = room.world(room.trials["trial_id"][0])
    assert (world.width, world.height) == (120, 80)
    assert world.obstacles.tolist() == [[30, 25, 8, 8, 1], [85, 50, 8, 6, 0]]
    assert narrow.details("as_written").nunique() == 12
    assert narrow.units["speed"] == "px/step"
    assert Counter(stopping(narrow)["why"]) == {"half width": 11, "max": 1}


@pytest.mark.parametrize("study", TRIALS)
def test_the_status_is_that_of_then(here: Path, study: str) -> None:
    assert said(here, "status", study) == status_of_then(study)


@pytest.mark.parametrize("study", ["room", "narrow"])
def test_means_are_those_of_then(here: Path, study: str) -> None:
    """Then all means had Student's intervals, and nobody told undefined values."""
    now = said(here, "table", study, "--interval", "t", "--json")
    alike(now, ended(here, study, "table.json"), new="_undefined$")


@pytest.mark.parametrize(
    "sides",
    [
        ("room:cohesion_weight=0.01", "room:cohesion_weight=5,alignment_weight=0.5"),
        ("narrow:as_run", "narrow:detail=drag"),
    ],
)
def test_comparisons_are_those_of_then(here: Path, sides: tuple[str, str]) -> None:
    """Then all differences had Student's and Welch's intervals. Normal metrics still
    have; p is adjusted for those of others too.
    """
    study = sides[0].partition(":")[0]
    now, known = said(here, "compare", *sides, "--json"), loaded(here, study)
    others = [
        number
        for number, row in enumerate(json.loads(now)["rows"])
        if known.distributions[row["metric"]].distribution != "normal"
    ]
    assert others
    changed = f"^/rows/({'|'.join(map(str, others))})/(low|high)$|/p$|/interval$"
    alike(now, expected(study, "compare.json"), but=changed, new="/undefined_[ab]$")


PLOTS = {
    "scatter-coverage": ("room", "scatter", "--metric", "coverage"),
    "coverage": ("room", "coverage"),
    "trajectories": ("room", "trajectories"),
    "curves": ("narrow", "curves", "--where", "detail=drag"),
    "history": ("gains", "history"),
}


@pytest.mark.parametrize("name", slow_but(["curves", "history"], PLOTS))
def test_figures_are_drawn(here: Path, name: str) -> None:
    figure = here / said(here, "plot", *PLOTS[name]).strip()
    assert figure.name == f"{name}.png"
    assert figure.stat().st_size > 10_000


@pytest.mark.parametrize("study", TRIALS)
@pytest.mark.usefixtures("same_kernels")
def test_the_same_spec_runs_nothing(here: Path, study: str) -> None:
    nothing = f"{study}: nothing was missing; {TRIALS[study]} trials"
    assert launched(here, study).startswith(nothing)
    unchanged(here, study)


@pytest.mark.usefixtures("same_kernels")
def test_the_report_of_a_search_is_that_of_then(here: Path) -> None:
    report = said(here, "search", "specs/gains.yaml", "--json")
    alike(report, ended(here, "gains", "search.json"))


LONGER = [
    ("room", "seeds: [27, 729]", "seeds: [27, 729, 4913]", 4),
    ("room", "[0.01, 5, 1.0e+308]", "[0.01, 0.5, 5, 1.0e+308]", 2),
    ("narrow", "half_width: 1.2", "half_width: 0.1", 9),
    ("gains", "{candidates: 2, replicates: 2}", "{candidates: 2, replicates: 3}", 3),
]


@pytest.mark.parametrize("longer", LONGER, ids=lambda longer: longer[2])
@pytest.mark.usefixtures("same_kernels")
def test_a_longer_spec_runs_the_new_trials_alone(here: Path, longer: Any) -> None:
    study, old, new, added = longer
    edit(here, study, old, new)
    if study != "gains":
        change = f"{added} added, {TRIALS[study]} kept, 0 dropped"
        assert change in said(here, "diff", f"specs/{study}.yaml")
    assert f"{study}: {added} new trials" in launched(here, study)
    assert loaded(here, study).statuses().total() == TRIALS[study] + added
    unchanged(here, study)


@pytest.mark.usefixtures("same_kernels")
def test_giving_room_back_merges_the_parts_and_keeps_every_trial(here: Path) -> None:
    assert "go         nothing; small parts are merged" in said(here, "gc", "room")
    assert len(list(here.glob("studies/room/parts/*"))) == 1
    unchanged(here, "room")


@pytest.mark.parametrize("study", TRIALS)
def test_other_kernels_read_what_is_stored(here: Path, study: str) -> None:
    unchanged(here, study)
    assert said(here, "status", study) == status_of_then(study)


@pytest.mark.parametrize("study", TRIALS)
def test_other_kernels_have_no_bits_to_compare(here: Path, study: str) -> None:
    refused = done(here, "verify", study)
    assert refused.returncode == 2
    whose = "computed by other code (by a version before 0.7)"
    way_out = f"check out {COMMIT} to verify the study"
    assert refused.stderr == f"study {study} was {whose}: {way_out}\n"


def test_other_kernels_run_every_trial_and_leave_the_old_ones_apart(here: Path) -> None:
    change = said(here, "diff", "specs/room.yaml")
    assert "trials     8 added, 0 kept, 8 dropped" in change
    assert "the code has changed (a version before 0.7 computed the trials)" in change
    assert "room: 8 new trials" in launched(here, "room")
    room, then = loaded(here, "room"), exported("room", "trials")["trial_id"]
    assert room.statuses().total() == room.apart() == len(then)
    assert set(room.trials["trial_id"]).isdisjoint(then)
    assert "apart     8 stored trials of another spec" in said(here, "status", "room")


def test_trials_of_other_kernels_stay_until_room_is_given_back(here: Path) -> None:
    launched(here, "room")
    rows = f"8 trials that were computed by other code, {THEN[:16]}"
    assert rows in said(here, "gc", "room", "--dry-run")
    assert loaded(here, "room").apart() == 8
    said(here, "gc", "room", "--yes")
    assert loaded(here, "room").apart() == 0
    assert len(loaded(here, "room").trials) == 8
