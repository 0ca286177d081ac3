"""Trials that fail: what a spec may say about them, and that launches and searches do
it.
"""

import json
import logging
import re
import signal
from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import sweep.workers.flying as flying_module
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.design.plan import make_plan
from sweep.errors import FailedTrialsError, SpecError
from sweep.methods.search.asked_trials import read_asked
from sweep.methods.search.plan import make_search_plan
from sweep.spec.failure_policy import Policy
from sweep.spec.study import parse_spec
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result, after, failed, overdue
from sweep.trial.simulation import run
from sweep.workers.failures import MOST_CAUSES, Failures, in_a_line
from tests.commands import sweep
from tests.searches import (
    ANALYTIC,
    TINY,
    analytic,
    asked_by,
    done,
    edited,
    equal,
    replace_trials,
    searched,
)
from tests.specs import short
from tests.studies import SMALL, launched, relaunch

MIB = 2**20


@pytest.mark.parametrize(
    ("lines", "policy"),
    [
        ([], Policy()),
        (["on_error: record"], Policy()),
        (["on_error: retry"], Policy("retry", 2)),
        (["on_error: retry", "retries: 5"], Policy("retry", 5)),
        (["on_error: stop"], Policy("stop")),
        (["failure_budget: 0"], Policy(budget=0)),
        (["on_error: retry", "failure_budget: 12"], Policy("retry", 2, budget=12)),
        (["failure_budget: 5%"], Policy(budget=Fraction(1, 20))),
        (["failure_budget: 0.5 %"], Policy(budget=Fraction(1, 200))),
        (["failure_budget: 100%"], Policy(budget=Fraction(1))),
        (["memory_limit: 2 GiB"], Policy(memory=2048 * MIB)),
        (["memory_limit: 1.5GB"], Policy(memory=1_500_000_000)),
        (["memory_limit: 400 MiB"], Policy(memory=400 * MIB)),
        (["memory_limit: 500000 kB"], Policy(memory=500_000_000)),
    ],
    ids=str,
)
def test_a_policy_is_read(lines: list[str], policy: Policy) -> None:
    assert parse_spec(short(*lines)).policy == policy


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            ["on_eror: retry"],
            'spec.yaml:6: unknown key "on_eror"; did you mean "on_error"?',
        ),
        (
            ["on_error: retyr"],
            (
                'spec.yaml:6: unknown on_error "retyr"; did you mean "retry"? Allowed:'
                " record, retry, stop"
            ),
        ),
        (["on_error: 3"], 'spec.yaml:6: "on_error" must be a string, not 3'),
        (
            ["retries: 2"],
            (
                'spec.yaml:6: "retries" needs "on_error: retry", and on_error is'
                " record: change"
            ),
        ),
        (
            ["on_error: stop", "retries: 2"],
            'spec.yaml:7: "retries" needs "on_error: retry", and on_error is stop',
        ),
        (
            ["on_error: retry", "retries: 0"],
            'spec.yaml:7: "retries" must be an integer from 1, not 0',
        ),
        (
            ["on_error: stop", "failure_budget: 5"],
            'spec.yaml:7: "failure_budget" needs "on_error: record" or "retry"',
        ),
        (
            ["failure_budget: -1"],
            'spec.yaml:6: "failure_budget" must be an integer from 0, not -1',
        ),
        (
            ["failure_budget: true"],
            (
                'spec.yaml:6: "failure_budget" must be a number of trials from 0, or a'
                " percentage from"
            ),
        ),
        (
            ["failure_budget: 0.05"],
            'a percentage from 0% to 100%, not 0.05; did you mean "5%"?',
        ),
        (["failure_budget: 101%"], 'a percentage from 0% to 100%, not "101%"'),
        (["failure_budget: five"], 'a percentage from 0% to 100%, not "five"'),
        (
            ["memory_limit: 2000"],
            (
                '"memory_limit" must be a size with a unit, such as "2 GiB" or'
                ' "1500 MB", not 2000'
            ),
        ),
        (
            ["memory_limit: -2 GiB"],
            (
                '"memory_limit" must be a size with a unit, such as "2 GiB" or'
                ' "1500 MB", not "-2 GiB"'
            ),
        ),
        (
            ["memory_limit: 2 gib"],
            (
                'unknown unit of memory "gib"; did you mean "GiB"? Allowed: B, kB, MB,'
                " GB, KiB"
            ),
        ),
        (
            ["memory_limit: 2 GiBs"],
            'unknown unit of memory "GiBs"; did you mean "GiB"?',
        ),
        (
            ["memory_limit: 399 MiB"],
            (
                '"memory_limit" is 399 MiB, and must be at least 400 MiB: a worker'
                " uses about"
            ),
        ),
        (
            ["memory_limit: 2000000 GiB"],
            '"memory_limit" is 2000000 GiB, more than the memory of any machine',
        ),
    ],
    ids=str,
)
def test_mistakes_are_said_with_their_line_and_what_is_allowed(
    lines: list[str], message: str
) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*lines))
    assert str(error.value).startswith("spec.yaml:")
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("policy", "trials", "allowed"),
    [
        (Policy(), 6, None),
        (Policy("stop"), 6, 0),
        (Policy(budget=4), 2, 4),
        (Policy(budget=Fraction(29, 100)), 100, 29),
        (Policy(budget=Fraction(5, 100)), 99, 4),
    ],
)
def test_shares_are_exact(policy: Policy, trials: int, allowed: int | None) -> None:
    """0.29 * 100 as a floating-point number is below 29."""
    assert policy.allowed(trials) == allowed


def test_trials_are_the_same_whatever_becomes_of_failed_ones() -> None:
    others = "on_error: retry\nretries: 7\nfailure_budget: 3%\nmemory_limit: 3 GiB\n"
    one, other = parse_spec(SMALL), parse_spec(SMALL + others)
    assert list(Jobs(one, expand(one))) == list(Jobs(other, expand(other)))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("", ""),
        ("on_error: stop\n", "the launch ends at the first failed trial"),
        (
            "on_error: retry\nretries: 1\nfailure_budget: 50%\n",
            (
                "failed trials run again at most 1 time; the launch ends when more"
                " than 3 of 6 trials have failed"
            ),
        ),
        (
            "memory_limit: 2 GiB\n",
            "a trial fails if the worker uses more than 2,048 MiB",
        ),
    ],
)
def test_the_plan_says_it_unless_it_is_the_default(lines: str, words: str) -> None:
    plan = make_plan(parse_spec(SMALL + lines), 2)
    assert plan.on_error == json.loads(plan.as_json())["on_error"] == words
    assert (f"on error   {words}" in plan.as_text()) == bool(words)
    assert ("on error" in plan.as_text()) == bool(words)


def test_the_plan_of_a_search_says_it_too() -> None:
    plan = make_search_plan(parse_spec(TINY + "on_error: stop\n"), 2)
    assert "on error   the launch ends at the first failed trial\n" in plan.as_text()


def test_errors_say_how_often_a_trial_was_tried_and_end_as_before() -> None:
    job: Any = None
    assert after(1, failed(job, "a\nb")) == failed(job, "a\nb")
    assert after(3, overdue(job, "a\nb")).error == "after 3 attempts: a\nb"
    assert after(3, Result(job, "done", 1.0)) == Result(job, "done", 1.0)
    assert in_a_line(" a\nb\n") == "b"
    assert in_a_line("\n") == "no error message"


def test_the_line_of_an_error_is_the_sentence_before_its_traceback() -> None:
    traced = "Traceback (most recent call last):\n  File\nValueError: b"
    again = f"{traced}\n\nDuring handling of another:\n\n{traced.replace('b', 'c')}"
    assert in_a_line(f"after 3 attempts: x.py, line 7\n\n{traced}\n") == (
        "after 3 attempts: x.py, line 7"
    )
    assert in_a_line(traced) == "ValueError: b"
    assert in_a_line(again) == "ValueError: c"


def test_a_cause_of_failures_is_said_at_the_first_trial_of_it_and_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """While the launch runs, with the way to end it."""
    study = parse_spec(SMALL)
    one, two, three, *_ = Jobs(study, expand(study))
    failures = Failures(study, Store(tmp_path / "small"), 6)
    failures.note([Result(two, "done", 0.0)])
    assert caplog.messages == []
    failures.note([failed(one, "TypeError: y"), failed(two, "x")])
    failures.note([failed(three, "x")])
    first, second = caplog.messages
    assert first.startswith("small: a trial has failed: TypeError: y")
    assert f'("sweep replay small {one.trial_id}" shows it)' in first
    assert "on_error: stop in the spec ends a launch at the first" in first
    assert f'failed: x ("sweep replay small {two.trial_id}" shows' in second
    assert "on_error" not in second


def test_of_many_causes_only_some_are_said_while_a_launch_runs(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    study = parse_spec(SMALL)
    failures = Failures(study, Store(tmp_path / "small"), 6)
    failures.note([failed(one, one.trial_id) for one in Jobs(study, expand(study))])
    assert len(caplog.messages) == MOST_CAUSES


def test_a_failure_that_ends_a_launch_is_said_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    study = parse_spec(SMALL + "on_error: stop\n")
    one, *_ = Jobs(study, expand(study))
    failures = Failures(study, Store(tmp_path / "small"), 1)
    failures.note([failed(one, "x")])
    assert caplog.messages == []
    with pytest.raises(FailedTrialsError, match=r"1 of 1 trial has failed.*: x \("):
        failures.check()


def test_the_first_error_of_this_launch_is_named(tmp_path: Path) -> None:
    """Rather than a later one, or one that is stored from before."""
    study = parse_spec(SMALL + "failure_budget: 2\n")
    one, two, *_ = Jobs(study, expand(study))
    failures = Failures(study, Store(tmp_path / "small"), 6)
    failures.note_stored(["0" * 24])
    failures.note([Result(two, "diverged", 0.0), failed(one, "first")])
    failures.check()
    failures.note([failed(two, "second")])
    with pytest.raises(
        FailedTrialsError,
        match=rf'^small: 3 of 6 .*; the first: first \("sweep .* {one.trial_id}"',
    ):
        failures.check()


class Trials:
    """A `run` whose trials fail as `fate` says: the status by the replicate and the
    number of the attempt from 1.

    `attempts` counts those of each trial, `order` has their ids as they ran.
    """

    def __init__(
        self, patch: pytest.MonkeyPatch, fate: Callable[[int, int], str]
    ) -> None:
        self.attempts: Counter[str] = Counter()
        self.order: list[str] = []
        self.fate = fate
        patch.setattr(flying_module, "run", self)
        patch.setattr(flying_module, "warm", lambda _job: None)

    def __call__(self, job: Job) -> Result:
        self.attempts[job.trial_id] += 1
        self.order.append(job.trial_id)
        status = self.fate(job.replicate, self.attempts[job.trial_id])
        return (
            run(job)
            if status == "done"
            else Result(job, status, 0.0, error=f"Traceback\nWrong: {status}")
        )


def first_replicate(status: str) -> Callable[[int, int], str]:
    return lambda replicate, _attempt: status if replicate == 0 else "done"


def test_a_trial_that_succeeds_at_last_has_the_row_of_an_undisturbed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It runs again after all others, and only as often as it takes."""
    whole = launched(SMALL, tmp_path / "whole")
    trials = Trials(
        monkeypatch,
        lambda replicate, attempt: "failed" if replicate >= attempt else "done",
    )
    with caplog.at_level(logging.WARNING):
        progress = relaunch(SMALL + "on_error: retry\n", tmp_path)
    assert progress.statuses == {"done": 6}
    assert sorted(trials.attempts.values()) == [1, 1, 2, 2, 3, 3]
    assert len(set(trials.order[:6])) == 6
    again = StoredStudy("small", tmp_path)
    pd.testing.assert_frame_equal(
        again.trials.drop(columns="seconds"), whole.trials.drop(columns="seconds")
    )
    pd.testing.assert_frame_equal(again.series, whole.series)
    assert [record.getMessage() for record in caplog.records] == [
        "small: attempt 2 of 3 will follow for 4 trials that failed; the first error:"
        " Wrong: failed",
        "small: attempt 3 of 3 will follow for 2 trials that failed; the first error:"
        " Wrong: failed",
    ]


@pytest.mark.parametrize("status", ["failed", "timeout"])
def test_a_trial_that_fails_every_time_is_recorded_once_with_its_attempts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, status: str
) -> None:
    trials = Trials(monkeypatch, first_replicate(status))
    progress = relaunch(SMALL + "on_error: retry\nretries: 3\n", tmp_path)
    assert progress.statuses == {"done": 4, status: 2}
    stored = StoredStudy("small", tmp_path).trials
    wrong = stored[stored["status"] == status]
    assert list(wrong["error"]) == [f"after 4 attempts: Traceback\nWrong: {status}"] * 2
    assert {trials.attempts[trial] for trial in wrong["trial_id"]} == {4}
    assert sum(trials.attempts.values()) == 4 + 2 * 4


def test_diverged_trials_are_results_and_not_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trials = Trials(monkeypatch, first_replicate("diverged"))
    assert relaunch(SMALL + "on_error: retry\n", tmp_path / "retry").statuses == {
        "done": 4,
        "diverged": 2,
    }
    assert set(trials.attempts.values()) == {1}
    for policy in ("on_error: stop\n", "failure_budget: 0\n"):
        assert relaunch(SMALL + policy, tmp_path / policy.split(":")[0]).statuses == {
            "done": 4,
            "diverged": 2,
        }


def test_an_interruption_between_attempts_loses_nothing_but_tries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The trials that had failed once are not stored yet: they count as not run."""

    def fate(replicate: int, attempt: int) -> str:
        if attempt == 2:
            signal.raise_signal(signal.SIGINT)
        return "failed" if replicate == 0 else "done"

    with monkeypatch.context() as patch:
        Trials(patch, fate)
        with pytest.raises(KeyboardInterrupt):
            relaunch(SMALL + "on_error: retry\nretries: 5\n", tmp_path)
    assert set(StoredStudy("small", tmp_path).trials["status"]) == {"done"}
    progress = relaunch(SMALL + "on_error: retry\nretries: 5\n", tmp_path)
    assert (progress.stored, progress.statuses) == (4, {"done": 2})


def test_stop_ends_the_launch_with_what_is_finished_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And so does the same command: a failed trial that is stored still counts, until
    it runs again.
    """
    trials = Trials(monkeypatch, first_replicate("failed"))
    with pytest.raises(FailedTrialsError) as ended:
        relaunch(SMALL + "on_error: stop\n", tmp_path)
    stored = StoredStudy("small", tmp_path).trials
    wrong = list(stored.loc[stored["status"] == "failed", "trial_id"])
    assert set(stored["trial_id"]) == set(trials.order)
    assert str(ended.value) in {
        f"small: {len(wrong)} of 6 trials {'has' if len(wrong) == 1 else 'have'}"
        " failed, and on_error is stop; the "
        f'first: Wrong: failed ("sweep replay small {trial}" shows it); finished'
        " trials are stored, and the same "
        "command with --retry runs the failed trials again"
        for trial in wrong
    }


MORE = SMALL.replace("replicates: 3", "replicates: 4")


def test_stored_failures_count_from_the_beginning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So the same command does not spend the budget anew; a larger budget or --retry
    lets it go on.
    """
    with monkeypatch.context() as patch:
        Trials(patch, first_replicate("failed"))
        assert relaunch(SMALL, tmp_path).statuses == {"done": 4, "failed": 2}
    trials = Trials(monkeypatch, lambda _replicate, _attempt: "done")
    for policy in ("on_error: stop\n", "failure_budget: 1\n", "failure_budget: 24%\n"):
        with pytest.raises(
            FailedTrialsError,
            match=r'^small: 2 of 8 trials have failed, .* Wrong: failed \("sweep rep',
        ):
            relaunch(MORE + policy, tmp_path)
    assert not trials.order
    assert relaunch(MORE + "failure_budget: 25%\n", tmp_path).statuses == {"done": 2}
    assert relaunch(MORE + "on_error: stop\n", tmp_path).missing == 0
    assert relaunch(MORE + "on_error: stop\n", tmp_path, retry=True).statuses == {
        "done": 2
    }


def test_failures_of_another_spec_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        Trials(patch, first_replicate("failed"))
        relaunch(SMALL, tmp_path)
    assert relaunch(
        SMALL.replace("steps: 9", "steps: 8") + "on_error: stop\n", tmp_path
    ).statuses == {"done": 6}


def test_with_retry_only_what_fails_again_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        Trials(patch, lambda _replicate, _attempt: "failed")
        relaunch(SMALL, tmp_path)
    Trials(monkeypatch, first_replicate("failed"))
    assert relaunch(SMALL + "failure_budget: 2\n", tmp_path, retry=True).statuses == {
        "done": 4,
        "failed": 2,
    }
    with pytest.raises(
        FailedTrialsError,
        match=(
            r"^small: 2 of 6 trials have failed, more than failure_budget allows \(1\)"
        ),
    ):
        relaunch(SMALL + "failure_budget: 1\n", tmp_path, retry=True)


@pytest.mark.parametrize(
    ("budget", "ends"),
    [("2", False), ("34%", False), ("1", True), ("33%", True), ("0", True)],
)
def test_a_budget_is_spent_by_what_still_fails_after_all_attempts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, budget: str, ends: bool
) -> None:
    """Of six trials four fail once, and two every time."""
    Trials(
        monkeypatch,
        lambda replicate, attempt: (
            "failed" if replicate == 0 or replicate == attempt else "done"
        ),
    )
    spec = SMALL + f"on_error: retry\nretries: 1\nfailure_budget: {budget}\n"
    if ends:
        with pytest.raises(FailedTrialsError, match=r"^small: [12] of 6 trials"):
            relaunch(spec, tmp_path)
    else:
        assert relaunch(spec, tmp_path).statuses == {"done": 4, "failed": 2}


def test_where_a_rule_adds_trials_a_share_is_of_the_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two points of 4 to 40 trials: of 80, a tenth are 8, which the looks at up to 15
    trials do not exceed.
    """
    rule = "replicates: {until: {metric: speed, half_width: 1e-9}, min: 4, max: 40}"
    spec = SMALL.replace("replicates: 3", rule) + "failure_budget: 10%\n"
    Trials(
        monkeypatch,
        lambda replicate, _attempt: "failed" if replicate % 4 == 0 else "done",
    )
    with pytest.raises(
        FailedTrialsError,
        match=r"^small: \d+ of at most 80 trials have failed, .* allows \(8\)",
    ):
        relaunch(spec, tmp_path)
    stored = StoredStudy("small", tmp_path).trials
    assert (stored["status"] == "failed").sum() in (9, 10)


def broken_above_one(job: Job) -> Result:
    """A search whose trials fail where the separation is above 1, as two of three
    candidates' do.
    """
    if job.settings["separation_weight"] > 1:
        return failed(job, "it went wrong")
    return done(job, {"flock_radius": -float(job.settings["separation_weight"])})


def test_a_search_that_stops_can_replay_the_first_failed_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even in the first batch; and the same command does not go on."""
    given = replace_trials(monkeypatch, broken_above_one)
    with pytest.raises(
        FailedTrialsError,
        match=r"^tiny: \d+ of at most 39 trials ha.+ failed, and on_error is stop",
    ) as ended:
        searched(TINY + "on_error: stop\n", tmp_path)
    found = re.search(
        r'it went wrong \("sweep replay tiny (\w+)" shows it\)', str(ended.value)
    )
    assert found is not None
    study, ran = StoredStudy("tiny", tmp_path), len(given)
    assert study.trial(found[1]).row["status"] == "failed"
    assert found[1] in set(read_asked(study).table["trial_id"])
    with pytest.raises(FailedTrialsError, match=r"^tiny: .* and on_error is stop"):
        searched(TINY + "on_error: stop\n", tmp_path)
    assert len(given) == ran


def test_a_search_that_its_budget_allows_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, broken_above_one)
    spec = edited(TINY, ("budget: 30", "budget: 12"))
    equal(
        asked_by(spec + "failure_budget: 100%\n", tmp_path / "one"),
        asked_by(spec, tmp_path / "other"),
    )


def test_a_search_tries_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every first attempt fails: what is found is what is found without any failure."""
    tried: set[str] = set()

    def at_second(job: Job) -> Result:
        known = job.trial_id in tried
        tried.add(job.trial_id)
        return analytic()(job) if known else failed(job, "it went wrong")

    replace_trials(monkeypatch, at_second)
    spec = edited(ANALYTIC, ("budget: 200", "budget: 20"))
    again = asked_by(spec + "on_error: retry\nretries: 1\n", tmp_path / "one")
    replace_trials(monkeypatch, analytic())
    equal(again, asked_by(spec, tmp_path / "other"))


SLOW = """
study: slow
model: nguyen2024
preset: as_run
fixed: {n: 50, steps: 8000}
replicates: 3
seed: 5
record: {series: [speed], every: 4000}
time_limit: 0.001
on_error: stop
"""
"""Two calls of the kernel, and between them a look at the clock: every trial takes
longer than a millisecond.
"""


def test_the_command_ends_with_one_sentence_and_the_first_error_can_be_replayed(
    tmp_path: Path,
) -> None:
    (tmp_path / "spec.yaml").write_text(SLOW)
    done = sweep(tmp_path, "launch", "spec.yaml", "--workers", "1")
    assert done.returncode == 1
    said = done.stderr.splitlines()[-1]
    found = re.fullmatch(
        r"slow: [123] of 3 trials (?:has|have) failed, and on_error is stop; the first:"
        r" time limit of 0.001 s reached "
        r'after step 4000 \("(sweep replay slow \w+)" shows it\); finished trials are'
        r" stored, and the same command "
        "with --retry runs the failed trials again",
        said,
    )
    assert found is not None, done.stderr
    assert "timeout" in sweep(tmp_path, "status", "slow").stdout
    replayed = sweep(tmp_path, *found[1].split()[1:])
    assert "last_step                          8000" in replayed.stdout
