"""How many trials a point gets: a number, or one for each listed seed."""

from typing import NamedTuple

from sweep.spec.contents import ListOf, Whole
from sweep.spec.document import Entry
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.schema_parts import Schema, one_of

TRIALS = Whole(1, MOST_TRIALS)
SEEDS = ListOf(Whole(0), "whole numbers from 0")


class Replication(NamedTuple):
    """The trials of a point: at most one of both is given.

    Attributes
    ----------
    replicates
        Their number. None where seeds are listed, or where a section of a method under
        `replicates` says it.
    seeds
        A seed for each trial.
    """

    replicates: int | None = None
    seeds: tuple[int, ...] | None = None


def read_replication(root: Entry) -> Replication:
    """Return what a spec has under `replicates` or `seeds`. Raises SpecError."""
    replicates = root.get("replicates")
    seeds = root.get("seeds")
    if (replicates is None) == (seeds is None):
        raise (seeds or root).error(
            'needs either "replicates" (trials a point) or "seeds" (a list),'
            " and not both"
        )
    if seeds:
        return Replication(seeds=SEEDS.read(seeds))
    assert replicates
    if isinstance(replicates.value, dict):
        return Replication()
    return Replication(replicates=TRIALS.read(replicates))


def replication_rules() -> Schema:
    """Return the check of `read_replication` of several keys as JSON Schema."""
    return one_of(["replicates", "seeds"])
