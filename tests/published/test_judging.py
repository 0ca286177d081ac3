"""Claims judged by what is stored: nothing is claimed of what has not been run."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.published.claims import Kind
from sweep.published.judging import Row, judged, stored_studies
from sweep.published.publications import Publication, read_all
from sweep.published.statements import tallies, together
from sweep.published.verdicts import Above, Status, Verdict
from sweep.workers.executors import Serial
from tests.publications import PUBLISHED, SPEC, experiments
from tests.published.test_scorecard import row
from tests.studies import share_of_each_point

HALF_FAILS = SPEC.replace(
    "separation_weight: [0.5, 1]",
    "case: {zip: {separation_weight: [0.5, 1], n_obstacles: [1, 6],"
    " obstacle_radius: [5000, 25]}}",
).replace("n: 40,", "n: 40, start_free: true,")
"""No place is free for the boids of the first point."""


def publication(folder: Path, spec: str = SPEC) -> Publication:
    """The tiny publication."""
    (found,) = read_all(experiments(folder, PUBLISHED, spec), quick=False)
    return found


def first(folder: Path, of: Publication) -> Row:
    """The row of its first claim."""
    rows, failures = judged(of, stored_studies(of, folder / "results"))
    assert failures == []
    return rows[0]


def test_nothing_is_claimed_of_what_has_not_been_run(tmp_path: Path) -> None:
    found = first(tmp_path, publication(tmp_path))
    assert found.verdict == Verdict("not run", "no trial of small is done")
    assert found.measured is None


def test_some_of_the_trials_are_no_verdict(tmp_path: Path) -> None:
    """The numbers of half of the trials are shown, with how many there are; all of them
    confirm the claim.
    """
    tiny = publication(tmp_path)
    study, results = tiny.studies["small"], tmp_path / "results"
    launch(study, results, Serial(), share=share_of_each_point(study))
    part = first(tmp_path, tiny)
    assert part.verdict.status == "partial"
    assert part.measured is not None
    assert 0 < part.measured.used < 8
    assert " of 16 trials of tiny/small are stored; so far: differs by" in (
        part.verdict.reason
    )
    assert tallies([part])["statement"] == {"partial": 1}
    launch(study, results, Serial())
    assert first(tmp_path, tiny).verdict.status == "confirmed"


def test_neither_are_those_of_which_some_failed(tmp_path: Path) -> None:
    tiny = publication(tmp_path, HALF_FAILS)
    launch(tiny.studies["small"], tmp_path / "results", Serial())
    found = first(tmp_path, tiny)
    assert found.verdict.status == "partial"
    assert "8 of 16 trials of tiny/small are stored" in found.verdict.reason


def test_neither_are_those_of_a_rule_that_asks_for_more(tmp_path: Path) -> None:
    """A launch that ends after the first look, which has three trials a point."""
    rule = "{until: {metric: speed, half_width: 0.001}, min: 3, max: 20}"
    spec = SPEC.replace("replicates: 8", f"replicates: {rule}")
    tiny = publication(tmp_path, spec)

    class StoppedError(Exception):
        pass

    def stop(progress: Progress) -> None:
        if progress.statuses.total() >= 6:
            raise StoppedError

    with pytest.raises(StoppedError):
        launch(tiny.studies["small"], tmp_path / "results", Serial(), report=stop)
    found = first(tmp_path, tiny)
    assert found.verdict.status == "partial"
    beginning = "the rule requires more trials of tiny/small"
    assert found.verdict.reason.startswith(beginning)


@pytest.mark.parametrize(
    ("statuses", "expected"),
    [
        (["confirmed", "confirmed"], "confirmed"),
        (["confirmed", "refuted", "undecided"], "refuted"),
        (["confirmed", "undecided", "not run"], "undecided"),
        (["confirmed", "partial", "not run"], "partial"),
        (["confirmed", "not run"], "not run"),
        (["not testable", "confirmed"], "confirmed"),
        (["not testable", "not run"], "not run"),
        (["not testable", "not testable"], "not testable"),
    ],
)
def test_a_statement_is_confirmed_where_all_that_is_tested_is(
    statuses: Sequence[Status], expected: Status
) -> None:
    assert together(statuses) == together([*reversed(statuses)]) == expected


def claimed(statement: str, kind: Kind, status: Status) -> Row:
    one = row(Above(0.0), 1.0, 2.0)
    claim = replace(one.claim, statement=statement, kind=kind)
    return one._replace(claim=claim, verdict=Verdict(status, ""))


def test_statements_are_counted_and_not_rows() -> None:
    """A statement tested four times counts once, and a fit confirms no statement."""
    rows = [
        claimed("a", "number", "confirmed"),
        claimed("a", "reading", "refuted"),
        claimed("a", "fit", "confirmed"),
        claimed("a", "hypothesis", "undecided"),
        claimed("b", "fit", "confirmed"),
        claimed("c", "reading", "confirmed"),
        claimed("c", "number", "confirmed"),
    ]
    assert tallies(rows) == {
        "statement": {"refuted": 1, "confirmed": 1},
        "exact": {},
        "hypothesis": {"undecided": 1},
        "fit": {"confirmed": 2},
    }
