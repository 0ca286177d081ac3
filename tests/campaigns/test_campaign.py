"""The driver of every campaign, with strategies that are made up here: what they ask
for follows from what is stored, whatever happens meanwhile.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from sweep.campaigns.campaign import run_campaign
from sweep.campaigns.design_plan import plan_tables
from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Look, Origin, PlanTables, Round
from sweep.design.design import expand
from sweep.design.jobs import Counts, Job, Jobs, SomeJobs
from sweep.errors import FailedTrialsError
from sweep.methods.search.asked_trials import read_asked
from sweep.methods.search.outcome import candidates
from sweep.methods.search.report import search_report
from sweep.methods.search.strategy import search
from sweep.replays.replaying import replay
from sweep.spec.study import Study, parse_spec
from sweep.store.shares import Share
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result, failed
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.reports import as_text
from tests.searches import TINY, done, edited, replace_trials
from tests.studies import SMALL

LINE = SMALL.replace("[0.5, 1]", "{linspace: [0, 1, 33]}").replace(
    "replicates: 3", "replicates: 1"
)
EDGE = 0.3
"""Where the speed of the made-up trials changes its sign."""

CHAINS = SMALL.replace("[0.5, 1]", "[0.5, 1, 2, 4, 8, 16]").replace(
    "replicates: 3", "replicates: 4"
)
HALVES = [Share(1, 2), Share(2, 2)]


def all_jobs(study: Study) -> Jobs:
    return Jobs(study, expand(study))


class Halving:
    """Looks for the point at which a value changes its sign: a batch has one point,
    half-way between those that are known to lie on either side.
    """

    grows = True
    looks_at = ("speed",)

    def __init__(self, spec: str) -> None:
        self.study = parse_spec(spec)
        self.jobs, self.progress = all_jobs(self.study), Progress(most=33)
        self.asked: list[int] = []

    def rounds(self, look: Look) -> Iterator[Round]:
        low, high = 0, len(self.jobs) - 1
        yield self._round([low, high])
        while high - low > 1:
            middle = (low + high) // 2
            yield self._round([middle])
            (speed,) = look()["speed"].to_pylist()
            low, high = (middle, high) if speed < 0 else (low, middle)

    def _round(self, places: list[int]) -> Round:
        self.asked += places
        ids = self.jobs.ids_at(np.array(places))
        return Round(ids, lambda some: self._jobs(places, some), self._plan)

    def _jobs(self, places: list[int], some: Counts) -> Sequence[Job]:
        return SomeJobs(self.jobs, np.array(places)[some])

    def _plan(self, origin: Origin) -> PlanTables:
        plan, _ = plan_tables(self.jobs.ids(), self.jobs, origin)
        return plan.read_all().take(self.asked).to_reader(), None


def beyond_the_edge(job: Job) -> Result:
    """A trial whose speed is how far its setting lies beyond the edge."""
    return done(job, {"speed": float(job.settings["separation_weight"]) - EDGE})


def halved(results: Path) -> StoredStudy:
    """What is stored after the edge was looked for."""
    strategy = Halving(LINE)
    run_campaign(strategy, results, Serial(), report=lambda _progress: None)
    return StoredStudy("small", results)


def test_what_is_asked_next_follows_from_what_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = replace_trials(monkeypatch, beyond_the_edge)
    study = halved(tmp_path)
    sought = study.plan["separation_weight"].to_numpy()
    assert len(given) == len(sought) == 7
    assert sorted(sought[np.argsort(abs(sought - EDGE))[:2]]) == [9 / 32, 10 / 32]
    halved(tmp_path)
    assert len(given) == 7


@pytest.mark.parametrize("stop", slow_but([3], range(7)))
def test_an_interrupted_campaign_goes_on_the_same_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: int
) -> None:
    given = replace_trials(monkeypatch, beyond_the_edge)
    whole = halved(tmp_path / "whole")

    def report(progress: Progress) -> None:
        if progress.statuses.total() > stop:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_campaign(Halving(LINE), tmp_path / "1", Serial(), report=report)
    plan = halved(tmp_path / "1").plan
    assert plan.equals(whole.plan)
    assert {job.trial_id for job in given} == set(plan["trial_id"].to_pylist())


class Chains:
    """A chain for each point. Its links are the replicates, one after the other, as
    long as the one before is done.
    """

    grows = True
    looks_at = ()

    def __init__(self, spec: str) -> None:
        self.study = parse_spec(spec)
        self.jobs, self.progress = all_jobs(self.study), Progress(most=24)

    def rounds(self, look: Look) -> Iterator[Round]:
        links = self.study.trials_per_point
        first = np.arange(0, len(self.jobs), links)
        for link in range(links):
            yield self._round(first, link)
            first = first[[one == "done" for one in look()["status"].to_pylist()]]

    def _round(self, first: Counts, link: int) -> Round:
        ids, places = self.jobs.ids(), first + link
        return Round(
            ids[places],
            lambda some: SomeJobs(self.jobs, places[some]),
            partial(plan_tables, ids, self.jobs),
            led_by=ids[first],
        )


def chained(
    results: Path, *, share: Share | None = None, retry: bool = False
) -> Progress:
    """The progress of a launch of chains."""
    done, options = (lambda _progress: None), {"share": share, "retry": retry}
    return run_campaign(Chains(CHAINS), results, Serial(), report=done, **options)


def breaking(job: Job) -> Result:
    """The third link of one chain fails."""
    if job.replicate == 2 and job.settings["separation_weight"] == 2:
        return failed(job, "the chain is broken")
    return done(job, {"speed": 1.0})


def test_chains_go_on_where_the_link_before_is_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = replace_trials(monkeypatch, breaking)
    assert chained(tmp_path).statuses == {"done": 22, "failed": 1}
    assert [job.replicate for job in given] == [0] * 6 + [1] * 6 + [2] * 6 + [3] * 5
    assert not chained(tmp_path).statuses
    replace_trials(monkeypatch, lambda job: done(job, {"speed": 1.0}))
    assert chained(tmp_path, retry=True).statuses == {"done": 2}
    assert set(StoredStudy("small", tmp_path).trials["status"]) == {"done"}


def test_a_share_has_whole_chains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Though the ids of their links belong to different shares."""
    given = replace_trials(monkeypatch, breaking)
    chained(tmp_path, share=HALVES[0])
    ours = {job.point for job in given}
    assert 0 < len(ours) < 6
    assert {half.has([job.trial_id])[0] for job in given for half in HALVES} == {
        True,
        False,
    }
    assert len(given) == 4 * len(ours) - (breaking_point() in ours)
    chained(tmp_path, share=HALVES[1])
    assert len(given) == 23
    assert ours.isdisjoint(job.point for job in given[4 * len(ours) :])
    assert StoredStudy("small", tmp_path).plan.num_rows == 24


def breaking_point() -> str:
    """The id of the point whose chain breaks."""
    return all_jobs(parse_spec(CHAINS)).points[2]


GROWING = SMALL.replace(
    "replicates: 3",
    "replicates: {until: {metric: speed, half_width: 1e-9}, min: 3, max: 9}",
)
SEARCH = TINY.replace("budget: 30", "budget: 20")


class Killed(BaseException):
    """Stands for the end of the process."""


@pytest.mark.parametrize(
    ("spec", "after"),
    [
        *(pytest.param(GROWING, after, id=f"until {after}") for after in (1, 6, 15)),
        *(
            pytest.param(SEARCH, after, id=f"search {after}")
            for after in (1, 5, 14, 21, 25)
        ),
    ],
)
def test_what_is_stored_when_a_launch_ends_is_in_its_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spec: str, after: int
) -> None:
    """Whatever ends it: a search is ended here within rungs, between them, and among
    the held-out trials.
    """
    replace_trials(monkeypatch, by_its_id)

    def report(progress: Progress) -> None:
        if progress.statuses.total() > after:
            raise Killed

    study = parse_spec(spec)
    with pytest.raises(Killed):
        launch(study, tmp_path, Serial(), report=report)
    stored = StoredStudy(study.name, tmp_path)
    trials = set(stored.store.trial_ids())
    assert len(trials) > after
    assert trials <= set(stored.plan["trial_id"].to_pylist())


@pytest.mark.parametrize("after", [0, 5, 21])
def test_an_interrupted_search_can_be_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    """Candidates whose trials have not run yet are among those that were asked."""
    replace_trials(monkeypatch, by_its_id)

    def report(progress: Progress) -> None:
        if progress.statuses.total() > after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        search(parse_spec(SEARCH), tmp_path, Serial(), report=report)
    study = StoredStudy("tiny", tmp_path)
    asked = read_asked(study)
    assert "missing" in set(asked.table["status"])
    stored = asked.table["status"] != "missing"
    searched = stored & (asked.table["phase"] == "search")
    assert candidates(asked)["trials"].sum() == searched.sum() > 0
    assert "The search is not finished" in as_text(search_report(study))


def by_its_id(job: Job) -> Result:
    """A trial whose metrics are made up from its id."""
    value = int(job.trial_id[:6], 16) / 2**24
    return done(job, {"speed": value, "flock_radius": value})


def test_a_held_out_trial_that_fails_is_in_the_plan_and_can_be_replayed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where it is the first failure, and ends the search."""
    with monkeypatch.context() as patched:
        replace_trials(
            patched,
            lambda job: (
                by_its_id(job) if job.seed == 5 else failed(job, "it went wrong")
            ),
        )
        spec = parse_spec(edited(SEARCH, ("seed: 5", "seed: 5\non_error: stop")))
        with pytest.raises(FailedTrialsError, match='"sweep replay tiny') as raised:
            search(spec, tmp_path, Serial())
    trial = str(raised.value).partition("sweep replay tiny ")[2].partition('"')[0]
    study = StoredStudy("tiny", tmp_path)
    assert trial in study.plan["trial_id"].to_pylist()
    assert replay(study, trial)[0].startswith(f"trial {trial}")
