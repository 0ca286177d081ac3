"""Studies with an axis that is continued: each link of a chain begins where the one
before it has ended, whatever interrupts a launch.
"""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.measuring import measure
from sweep.campaigns.progress import Progress
from sweep.cli.listing import status_text
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs, LastFlock, SomeJobs, stream
from sweep.errors import ChoiceError, SpecError, StoreError
from sweep.methods.comparison import Matching, match, side_of
from sweep.replays.replaying import replay
from sweep.replays.verifying import verify
from sweep.sharing.content import content_hash
from sweep.store.link_beginnings import chains, with_beginning
from sweep.store.locations import ObjectPath, ObjectServer
from sweep.store.shares import Share
from sweep.tables.chains import cut_off
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result, failed
from sweep.trial.simulation import Simulation
from sweep.web.replaying import Replay
from sweep.workers.executors import Loky, Serial
from tests.cases import slow_but
from tests.object_stores import Memory
from tests.searches import done, replace_trials
from tests.studies import SMALL, launched, read, relaunch, same

AXIS = "separation_weight: {values: [0.5, 1, 2], continue: both, hold: 9}"
HERE = Path(__file__).parent
CHAINED = SMALL.replace("n: 12, steps: 9", "n: 12").replace(
    "separation_weight: [0.5, 1]", AXIS
)
INSERTED = CHAINED.replace("[0.5, 1, 2]", "[0.5, 1, 1.5, 2]")


FOLD = """
study: fold
model: ./fold.py
fixed: {n: 3, start_speed: 0}
sweep:
  field: {linspace: [-1, 1, 21], continue: both, hold: 400}
replicates: 2
record: {metrics: [./fold.py]}
"""
TURNING = 2.0 / (3.0 * math.sqrt(3.0))
"""Of v' = field + v - v^3: on either side of it one of the branches ends."""


def jobs_of(text: str) -> list[Job]:
    """All jobs of a spec."""
    study = read(text)
    return Jobs(study, expand(study))[:]


def by_link(text: str) -> dict[tuple[str, float, int], Job]:
    """The jobs of a spec by their direction, value and replicate."""
    return {
        (job.direction, float(job.settings["separation_weight"]), job.replicate): job
        for job in jobs_of(text)
    }


def test_each_link_has_the_one_before_as_its_parent() -> None:
    links = by_link(CHAINED)
    way = [("up", 0.5), ("up", 1), ("up", 2), ("down", 2), ("down", 1), ("down", 0.5)]
    for replicate in range(3):
        chain = [links[(*link, replicate)] for link in way]
        parents = ["", *(job.trial_id for job in chain)]
        assert [job.parent for job in chain] == parents[:-1]
    assert len({job.trial_id for job in links.values()}) == 18
    assert {job.settings["steps"] for job in links.values()} == {9}


def test_chains_differ_in_the_other_axes() -> None:
    text = CHAINED.replace("sweep:", "sweep:\n  cohesion_weight: [0.01, 0.02]")
    jobs = {job.trial_id: job for job in jobs_of(text)}
    first = [job for job in jobs.values() if not job.parent]
    assert len(first) == 2 * 3
    for job in jobs.values():
        if job.parent:
            before = jobs[job.parent]
            assert before.settings["cohesion_weight"] == job.settings["cohesion_weight"]
            assert before.replicate == job.replicate


def test_links_have_random_numbers_of_their_own() -> None:
    """Also those of one value on the way up and down."""
    for kind in ("independent", "lasting"):
        found = [
            tuple(stream(job, "noise").spawn_key)
            for job in jobs_of(CHAINED + f"streams: {{noise: {kind}}}\n")
        ]
        assert len(set(found)) == len(found) == 18


def test_ids_are_those_of_plain_jobs_and_of_whole_tables() -> None:
    study = read(CHAINED)
    jobs = Jobs(study, expand(study))
    table = jobs.table()
    assert table["trial_id"].to_pylist() == [job.trial_id for job in jobs]
    assert table["parent"].to_pylist() == [job.parent or None for job in jobs]


def test_an_inserted_value_changes_exactly_what_is_downstream(tmp_path: Path) -> None:
    launched(CHAINED, tmp_path)
    progress = relaunch(INSERTED, tmp_path)
    kept = [("up", 0.5), ("up", 1)]
    before, now = by_link(CHAINED), by_link(INSERTED)
    assert [link for link in now if now[link].trial_id in ids(before.values())] == [
        (*link, replicate) for link in kept for replicate in range(3)
    ]
    assert (progress.stored, progress.statuses) == (6, {"done": 18})
    study = StoredStudy("small", tmp_path)
    assert same(study, launched(INSERTED, tmp_path / "anew"))
    assert verify(study, Serial(), fraction=1.0).same
    assert not relaunch(CHAINED, tmp_path).statuses


def ids(jobs: object) -> set[str]:
    """The ids of jobs."""
    return {job.trial_id for job in jobs}  # type: ignore[attr-defined]


def test_a_link_begins_with_the_flock_of_the_one_before(tmp_path: Path) -> None:
    study = launched(CHAINED, tmp_path)
    for job in jobs_of(CHAINED):
        stored = study.job(study.trial(job.trial_id))
        assert (stored.direction, stored.parent) == (job.direction, job.parent)
        assert stored.point == job.point
        if job.parent:
            parent = Simulation(study.job(study.trial(job.parent)))
            while parent.steps_left:
                parent.advance(parent.steps_left)
                parent.take_frames()
            begun = Simulation(stored)
            for mine, theirs in zip(begun.flock[:4], parent.flock[:4], strict=True):
                assert mine.tobytes() == theirs.tobytes()
            assert begun.step == 0
        report, equal = replay(study, job.trial_id)
        assert equal, report


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same(tmp_path: Path) -> None:
    one = launched(CHAINED, tmp_path / "one")
    assert same(one, launched(CHAINED, tmp_path / "two", Loky(2)))


def test_an_object_store_has_chains_too(tmp_path: Path) -> None:
    server = ObjectServer()
    server.__dict__["files"] = Memory()
    bucket = ObjectPath(server, "bucket")
    with pytest.raises(KeyboardInterrupt):
        launch(read(CHAINED), bucket, Serial(), report=interrupt_after(7))
    assert same(launched(CHAINED, bucket), launched(CHAINED, tmp_path))


def interrupt_after(trials: int):
    """A report that interrupts after so many new trials."""

    def report(progress: Progress) -> None:
        if progress.statuses.total() >= trials:
            raise KeyboardInterrupt

    return report


@pytest.mark.parametrize("after", slow_but([2, 17], [1, 2, 4, 9, 17]))
def test_an_interrupted_launch_goes_on_at_the_link(tmp_path: Path, after: int) -> None:
    with pytest.raises(KeyboardInterrupt):
        launch(read(CHAINED), tmp_path, Serial(), report=interrupt_after(after))
    stored = len(StoredStudy("small", tmp_path).trials)
    assert after <= stored < 18
    assert relaunch(CHAINED, tmp_path).statuses == {"done": 18 - stored}
    study = StoredStudy("small", tmp_path)
    assert content_hash(study) == content_hash(launched(CHAINED, tmp_path / "anew"))


@pytest.mark.parametrize("lost", [[4], [1, 4], [4, 7, 10], [0, 16]])
def test_links_that_are_missing_run_in_chains_from_those_that_are_stored(
    tmp_path: Path, lost: list[int]
) -> None:
    """Also where later links are stored. Places are in the order of the plan."""
    study = launched(CHAINED, tmp_path)
    jobs = Jobs(read(CHAINED), expand(read(CHAINED)))
    missing = chains(study.store, SomeJobs(jobs, np.array(lost)))
    assert sorted(one for chain in missing.links for one in chain) == lost
    for place, chain in enumerate(missing.links):
        assert all(
            jobs[one].trial_id == jobs[after].parent for one, after in pairwise(chain)
        )
        job = missing[place]
        assert (job.begins is None) == (not job.parent)
        assert replay(study, job.trial_id)[1]


def broken(job: Job) -> Result:
    """The second link on the way up fails in one replicate."""
    if (job.direction, job.settings["separation_weight"], job.replicate) == (
        "up",
        1,
        1,
    ):
        return failed(job, "the chain is broken")
    return replace(done(job, {"speed": 1.0}), last_flock=nowhere(job))


def nowhere(job: Job) -> LastFlock:
    """All boids at the origin, at rest."""
    n = int(job.settings["n"])
    return LastFlock(np.zeros((4, n)), np.ones((2, n)), np.zeros((0, n)))


def test_a_link_that_fails_ends_its_chain(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = replace_trials(monkeypatch, broken)
    progress = relaunch(CHAINED + "on_error: record\n", tmp_path)
    assert progress.statuses == {"done": 13, "failed": 1}
    assert progress.left == 4
    assert len(given) == 14
    study = StoredStudy("small", tmp_path)
    assert cut_off(study) == {"failed": 4}
    said = "cut off   4 trials of chains, not run: an earlier link failed"
    assert said in status_text(study)
    assert not relaunch(CHAINED + "on_error: record\n", tmp_path).statuses
    replace_trials(
        monkeypatch,
        lambda job: replace(done(job, {"speed": 1.0}), last_flock=nowhere(job)),
    )
    again = relaunch(CHAINED + "on_error: record\n", tmp_path, retry=True)
    assert again.statuses == {"done": 5}
    assert not cut_off(StoredStudy("small", tmp_path))


def test_a_link_that_is_tried_again_goes_on_with_its_chain(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[str] = []

    def once(job: Job) -> Result:
        given.append(job.trial_id)
        return broken(job) if given.count(job.trial_id) == 1 else mended(job)

    def mended(job: Job) -> Result:
        assert (job.begins is None) == (not job.parent)
        return replace(done(job, {"speed": 1.0}), last_flock=nowhere(job))

    replace_trials(monkeypatch, once)
    assert relaunch(CHAINED + "on_error: retry\nretries: 1\n", tmp_path).statuses == {
        "done": 18
    }
    assert len(given) == 19


def test_a_comparison_tells_directions_apart(tmp_path: Path) -> None:
    study = launched(CHAINED, tmp_path)

    def matching(one: str, other: str) -> Matching:
        return match(*(side_of(f"{study.name}:{at}", study) for at in (one, other)))

    ways = matching("direction=up", "direction=down")
    assert ways.differ == {"direction": (["up"], ["down"])}
    assert ways.names == ["separation_weight"]
    values = matching("separation_weight=0.5", "separation_weight=1")
    assert values.differ == {"separation_weight": ([0.5], [1.0])}
    assert values.settings["direction"].tolist() == ["up", "down"]


def test_a_share_has_whole_chains(tmp_path: Path) -> None:
    text = CHAINED.replace("replicates: 3", "replicates: 8")
    halves = [Share(1, 2), Share(2, 2)]
    found = []
    for half in halves:
        progress = launch(read(text), tmp_path, Serial(), share=half)
        found.append(progress.statuses["done"])
        assert not progress.left
    assert sum(found) == 48
    assert all(count % 6 == 0 and 0 < count < 48 for count in found)
    assert same(StoredStudy("small", tmp_path), launched(text, tmp_path / "whole"))


def test_a_link_whose_parent_is_gone_cannot_be_replayed(tmp_path: Path) -> None:
    study = launched(CHAINED, tmp_path)
    job = next(job for job in jobs_of(CHAINED) if job.parent)
    lost = replace(job, parent="0" * 24)
    with pytest.raises(StoreError, match="is no longer stored; launch"):
        with_beginning(study.store, lost)


def branch(field: float, direction: str) -> float:
    """The equilibrium of a boid that comes from below or from above."""
    roots = np.roots([-1.0, 0.0, 1.0, field])
    real = roots.real[abs(roots.imag) < 1e-9]
    return float(min(real) if direction == "up" else max(real))


@pytest.mark.slow
def test_the_turning_points_of_a_fold_are_exact(tmp_path: Path) -> None:
    """Way up and way down keep to their branch as far as it goes. The time constant is
    largest beside a turning point, 1 / |1 - 3 v^2| = 2.6 for a field of 0.3: 400 steps
    of 0.1 bring what is left of a jump below 1e-5.
    """
    (tmp_path / "fold.py").write_text((HERE / "fold.py").read_text())
    (tmp_path / "fold.yaml").write_text(FOLD)
    study = read(tmp_path / "fold.yaml")
    launch(study, tmp_path, Serial())
    stored = StoredStudy("fold", tmp_path)
    assert len(stored.trials) == 2 * 42
    for row in stored.trials.itertuples():
        assert row.rightwards == pytest.approx(
            branch(row.field, row.direction), abs=1e-5
        )
    up = stored.trials[stored.trials["direction"] == "up"]
    jumped = up[up["rightwards"] > 0]["field"].min()
    assert jumped - 0.1 < TURNING < jumped


def test_the_page_replays_a_link(tmp_path: Path) -> None:
    study = launched(CHAINED, tmp_path)
    for job in jobs_of(CHAINED)[::5]:
        page = Replay(study, job.trial_id)
        assert page.differences == []
        assert page.which.startswith(f"direction {job.direction}, separation weight ")
        (placed,) = [one for one in page.greeting() if one.get("trial")]
        assert placed["trial"]["values"]["direction"] == job.direction


def test_further_metrics_of_chains_are_refused(tmp_path: Path) -> None:
    launched(CHAINED, tmp_path)
    with pytest.raises(ChoiceError, match='add the metrics under "record"'):
        measure("small", ["dispersion"], tmp_path, Serial())


REFUSED = [
    ("continue: both", "continue: bot", 'unknown way "bot"; did you mean "both"?'),
    ("hold: 9", "hold: 0", '"hold" must be an integer from 1, not 0'),
    ("continue: both, ", "", '"hold" needs an axis with "continue"'),
    ("n: 12", "n: 12, steps: 9", '"hold" and "steps" both give the number of steps'),
    ("separation_weight:", "start_speed:", "only parameters of the model can change"),
    ("hold: 9", 'hold: 9, when: "n > 1"', 'the axis has a condition, "when"'),
    ("seed: 5", "seed: 5\nstreams: {noise: common}", "must be independent or lasting"),
    ("seed: 5", "seed: 5\norder: coarse", 'takes no "order"'),
    (
        "seed: 5",
        "seed: 5\nderive: {n: 10 * separation_weight}",
        "n cannot change from link to link",
    ),
    (
        "sweep:",
        "sweep:\n  cohesion_weight: {values: [1, 2], continue: up}",
        "a study has at most one continued axis",
    ),
    (
        "replicates: 3",
        "replicates: {until: {metric: speed, half_width: 1}, min: 3, max: 9}",
        "needs a fixed number of replicates",
    ),
    ("[0.5, 1, 2]", "[0.5]", 'drawn.yaml:7: "separation_weight" cannot be continued:'),
    ("[0.5, 1, 2]", "[1]", "a chain needs at least 2 values"),
    (
        "every: 2}",
        "every: 2, last_flocks: false}",
        'drawn.yaml:10: a study with "continue" keeps "last_flocks"',
    ),
]


@pytest.mark.parametrize(("old", "new", "said"), REFUSED)
def test_what_cannot_be_continued_is_refused(old: str, new: str, said: str) -> None:
    assert old in CHAINED
    text = CHAINED.replace(old, new, 1)
    if "derive: {n" in new:
        text = text.replace("fixed: {n: 12}\n", "")
    with pytest.raises(SpecError) as raised:
        expand(read(text))
    assert said in str(raised.value)
    assert str(raised.value).startswith("drawn.yaml:")
