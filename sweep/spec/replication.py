"""Number of trials per point: a number, or one trial per listed seed."""

from typing import NamedTuple

from sweep.spec.contents import ListOf, Whole
from sweep.spec.document import Entry
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.recording import RECORDING
from sweep.spec.schema_parts import Schema, one_of

TRIALS = Whole(1, MOST_TRIALS)
SEEDS = ListOf(Whole(0), "integers from 0")


class Replication(NamedTuple):
    """The trials of a point, by number or by seeds, at most one of the two.

    Attributes
    ----------
    replicates : int, optional
        Number of trials. None if seeds are listed, or if a section of a method under
        `replicates` decides the number.
    seeds : tuple of int, optional
        A seed for each trial.
    """

    replicates: int | None = None
    seeds: tuple[int, ...] | None = None


def read_replication(root: Entry) -> Replication:
    """Return the value of `replicates` or `seeds` of a spec. Raises SpecError."""
    replicates = root.get("replicates")
    seeds = root.get("seeds")
    if replicates and seeds:
        raise seeds.error('give "replicates" or "seeds", not both')
    if not (replicates or seeds):
        raise root.lacks(
            "replicates",
            'missing "replicates" (trials per point) or "seeds" (a list of seeds)',
        )
    if seeds:
        return Replication(seeds=SEEDS.read(seeds))
    assert replicates
    if isinstance(replicates.value, dict):
        return Replication()
    return Replication(replicates=TRIALS.read(replicates))


def replication_rules() -> Schema:
    """Return the check of `read_replication` of several keys as JSON Schema.

    The events of a recording are the trials of a study with a recording.
    """
    return one_of(["replicates", "seeds", RECORDING])
