"""What a change of a spec does: points and trials that it adds, keeps and drops,
exactly, without running any.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from kernels.catalogue import BUILT_IN
from kernels.identity import Code
from sweep.design.code import study_code
from sweep.design.design import expand
from sweep.design.jobs import Jobs, SomeJobs
from sweep.design.trial_ids import Ids, KnownIds
from sweep.spec.document import Document
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.store.recordings import Served, others_stored, served
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy

MOST_SHOWN = 60


class SpecVersion(NamedTuple):
    """One of the two that are compared: its spec as plain values, its code, its
    trials and points.

    `counted` says which of its trials they are, where they follow from results.
    """

    label: str
    name: str
    counted: str
    spec: dict[str, Any]
    code: Code | None
    trials: pa.Array
    points: pa.Array


@dataclass(frozen=True)
class Change:
    """A key of the spec, as `fixed.steps`, with its value before and after; None where
    it has none.
    """

    key: str
    before: Any
    after: Any


@dataclass(frozen=True)
class Overlap:
    """How many are in the second only, in both, in the first only."""

    added: int
    kept: int
    dropped: int


@dataclass(frozen=True)
class SpecDifference:
    """What turns `first` into `second`; `stored` counts the trials of the second that
    are stored already.
    """

    first: str
    second: str
    points: Overlap
    trials: Overlap
    stored: int
    to_run: int
    changes: tuple[Change, ...]
    notes: tuple[str, ...]

    def as_json(self) -> str:
        """The comparison as a JSON object."""
        return json.dumps(asdict(self), indent=2)

    def as_text(self) -> str:
        """The comparison for a reader."""
        lines = [f"from       {self.first}", f"to         {self.second}"]
        for what, overlap in (("points", self.points), ("trials", self.trials)):
            lines.append(
                f"{what:10} {overlap.added:,} added, {overlap.kept:,} kept,"
                f" {overlap.dropped:,} dropped"
            )
        lines.append(
            f"stored     {self.stored:,} of the trials it would have,"
            f" {self.to_run:,} to run"
        )
        lines += [
            f"changed    {one.key}: {_brief(one.before)} -> {_brief(one.after)}"
            for one in self.changes
        ]
        return "\n".join(lines + [f"note       {note}" for note in self.notes])


def compare(
    first: Study | StoredStudy, second: Study, results: Location
) -> SpecDifference:
    """What a launch of `second` into `results` would change, where `first` is another
    spec or a stored study.

    Raises SpecError for a design that cannot be, and StoreError for a damaged store.
    """
    store = Store(results / second.name, results)
    statuses = store.trial_ids()
    before, after = (_side(one, store, statuses) for one in (first, second))
    there = _among(after.trials, pa.array(statuses, pa.string()))
    return SpecDifference(
        first=before.label,
        second=after.label,
        points=_overlap(pc.unique(before.points), pc.unique(after.points)),
        trials=_overlap(before.trials, after.trials),
        stored=there,
        to_run=len(after.trials) - there,
        changes=tuple(_changes(before.spec, after.spec)),
        notes=tuple(_notes(before, after)),
    )


def _side(
    one: Study | StoredStudy, store: Store, statuses: Mapping[str, str]
) -> SpecVersion:
    if isinstance(one, StoredStudy):
        spec = parse_document(one.spec, Path("stored spec")).value
        trials, points = (
            one.plan[name].combine_chunks() for name in ("trial_id", "point")
        )
        return SpecVersion(
            f"{one.name}, as last launched",
            one.name,
            "",
            spec,
            one.code,
            trials,
            points,
        )
    if one.search:
        message = (
            "a search asks for its trials as it goes:"
            " what it would add is not known before"
        )
        raise one.document.error(("search",), message)
    design, first = expand(one), None
    if one.rule and one.rule.adds_points:
        first = np.full(design.n_points, one.rule.least)
    jobs = Jobs(one, design, first)
    ids = jobs.ids()
    ids = _served(one, jobs, ids, store, statuses).into(ids)
    table = jobs.rows(np.arange(len(jobs)), ids)
    trials, points = (table[name].combine_chunks() for name in ("trial_id", "point"))
    return SpecVersion(
        str(one.path),
        one.name,
        one.rule.counted if one.rule else "",
        _values(one.document),
        study_code(one),
        trials,
        points,
    )


def _served(
    study: Study,
    jobs: Jobs,
    ids: Ids,
    store: Store,
    statuses: Mapping[str, str],
) -> Served:
    """Which trials a launch would take from those that record more."""
    known = KnownIds.of_column(pa.chunked_array([[*statuses]], pa.string()))
    done = [status == "done" for status in statuses.values()]
    return served(
        study,
        SomeJobs(jobs, np.flatnonzero(known.places(ids) < 0)),
        others_stored(store, study),
        known,
        np.array(done, np.bool_),
    )


def _values(document: Document) -> dict[str, Any]:
    values: dict[str, Any] = parse_document(document.text, document.path).value
    return values


def _overlap(before: pa.Array, after: pa.Array) -> Overlap:
    kept = _among(after, before)
    return Overlap(len(after) - kept, kept, len(before) - kept)


def _among(some: pa.Array, others: pa.Array) -> int:
    return int(pc.sum(pc.is_in(some, value_set=others), min_count=0).as_py())


def _changes(before: Any, after: Any, key: str = "") -> Iterator[Change]:
    """Mappings are followed key by key; any other value counts as a whole."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in dict.fromkeys([*before, *after]):
            place = f"{key}.{name}" if key else name
            yield from _changes(before.get(name), after.get(name), place)
    elif json.dumps(before) != json.dumps(after):
        yield Change(key, before, after)


def _notes(before: SpecVersion, after: SpecVersion) -> Iterator[str]:
    if before.code is None or after.code is None:
        changes = ["a version before 0.7 computed them"]
    else:
        changes = before.code.changes(after.code)
    if changes:
        said = ", ".join(changes)
        yield f"the code has changed ({said}): trials that it computes are other ones"
    names = list(_names(before, after))
    if names:
        said = ", ".join(names)
        yield f"own code has other names ({said}): trials with these are other ones"
    if before.name != after.name:
        yield (
            f"these are two studies: {after.name} has a folder of its own and takes no"
            f" trial from {before.name}"
        )
    for side in (before, after):
        if side.counted:
            yield f"{side.label}: {side.counted}"
    if (
        not changes
        and not names
        and not after.counted
        and before.spec == after.spec
        and _among(after.trials, before.trials) < len(after.trials)
    ):
        yield (
            "the specs are the same: a table or an image has changed, this version"
            " reads it otherwise, or the first was not run to its end"
        )


def _names(before: SpecVersion, after: SpecVersion) -> Iterator[str]:
    """The entries that the code of one side has and the other lacks, in words, but for
    ours and those that a spec calls by name: its changed keys say them. An entry that
    differs in nothing but its name is `model vortex -> swirl`.
    """
    if before.code is None or after.code is None:
        return
    for kind in Code._fields[1:]:
        gone, new = (
            _own_names(kind, one, other)
            for one, other in ((before, after), (after, before))
        )
        entry = kind.removesuffix("s")
        for name, stamp in gone.items():
            same = next((other for other in new if new[other] == stamp), None)
            if same:
                del new[same]
            yield f"{entry} {name} -> {same}" if same else f"{entry} {name} is gone"
        for name in new:
            yield f"{entry} {name} is new"


def _own_names(kind: str, one: SpecVersion, other: SpecVersion) -> dict[str, str]:
    """The stamps of the entries of a kind that only one side has."""
    # Stamps of models are those of a name with a preset.
    mine, theirs = (
        {
            key.partition(" ")[0]: stamp
            for key, stamp in getattr(side.code, kind).items()
        }
        for side in (one, other)
    )
    known = {*theirs, *_texts(one.spec), *getattr(BUILT_IN, kind)}
    return {name: stamp for name, stamp in mine.items() if name not in known}


def _texts(value: Any) -> Iterator[str]:
    """The texts in a spec, wherever they stand."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for part in [*value, *value.values()] if isinstance(value, dict) else value:
            yield from _texts(part)


def _brief(value: Any) -> str:
    text = (
        "-" if value is None else value if isinstance(value, str) else json.dumps(value)
    )
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]} ..."
