"""The effects of a change of a spec: points and trials that are added, kept, dropped.

The counts are exact, and no trial runs.
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
from sweep.design import Ids, Jobs, KnownIds, SomeJobs, expand, study_code
from sweep.spec import Document, Study, parse_document
from sweep.store import Location, Served, Store, others_stored, served
from sweep.tables.stored_study import StoredStudy

MOST_SHOWN = 60


class SpecVersion(NamedTuple):
    """A version in a comparison: its spec as plain values, code, trials and points.

    If the trials of a study depend on results, `counted` is a note on the counted
    trials.
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
    """A changed key of the spec, such as `fixed.steps`, with the two values.

    The value is None where the key is absent.
    """

    key: str
    before: Any
    after: Any


@dataclass(frozen=True)
class Overlap:
    """The numbers of points or trials added, in common, and dropped."""

    added: int
    common: int
    dropped: int

    def as_dict(self) -> dict[str, int]:
        """Return the numbers by the keys in JSON."""
        return {"added": self.added, "kept": self.common, "dropped": self.dropped}


@dataclass(frozen=True)
class SpecDifference:
    """The changes from `first` to `second`.

    `stored` is the number of stored trials of `second`.
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
        """Return the comparison as a JSON object."""
        overlaps = {"points": self.points.as_dict(), "trials": self.trials.as_dict()}
        return json.dumps(asdict(self) | overlaps, indent=2)

    def as_text(self) -> str:
        """Return the comparison for a reader."""
        lines = [f"from       {self.first}", f"to         {self.second}"]
        for noun, overlap in (("points", self.points), ("trials", self.trials)):
            lines.append(
                f"{noun:10} {overlap.added:,} added, {overlap.common:,} kept,"
                f" {overlap.dropped:,} dropped"
            )
        lines.append(
            f"stored     {self.stored:,} of the planned trials, {self.to_run:,} to run"
        )
        for change in self.changes:
            values = f"{_brief(change.before)} -> {_brief(change.after)}"
            lines.append(f"changed    {change.key}: {values}")
        return "\n".join(lines + [f"note       {note}" for note in self.notes])


def compare(
    first: Study | StoredStudy, second: Study, results: Location
) -> SpecDifference:
    """Compare a study with a spec: the points and trials that a launch would change.

    Parameters
    ----------
    first : Study or StoredStudy
        Another spec, or a stored study.
    second : Study
        The spec that would be launched.
    results : Location
        The folder of the results of the launch.

    Returns
    -------
    SpecDifference

    Raises
    ------
    SpecError
        If a design cannot be built, or a spec is a search.
    StoreError
        If the store is damaged.
    """
    store = Store(results / second.name, results)
    statuses = store.trial_ids()
    before, after = (_version(study, store, statuses) for study in (first, second))
    stored = _among(after.trials, pa.array(statuses, pa.string()))
    return SpecDifference(
        first=before.label,
        second=after.label,
        points=_overlap(pc.unique(before.points), pc.unique(after.points)),
        trials=_overlap(before.trials, after.trials),
        stored=stored,
        to_run=len(after.trials) - stored,
        changes=tuple(_changes(before.spec, after.spec)),
        notes=tuple(_notes(before, after)),
    )


def _version(
    study: Study | StoredStudy, store: Store, statuses: Mapping[str, str]
) -> SpecVersion:
    if isinstance(study, StoredStudy):
        return SpecVersion(
            label=f"{study.name}, as last launched",
            name=study.name,
            counted="",
            spec=parse_document(study.spec, Path("stored spec")).value,
            code=study.code,
            trials=study.plan["trial_id"].combine_chunks(),
            points=study.plan["point"].combine_chunks(),
        )
    if study.strategy_section and not study.has_design:
        section, _ = study.strategy_section
        message = (
            f'"{section.key.name}" chooses trials during the run:'
            " the changes are not known in advance"
        )
        raise study.document.error(section.place, message)
    design = expand(study)
    replicates = None
    if study.rule and study.rule.adds_points:
        replicates = np.full(design.n_points, study.rule.least)
    jobs = Jobs(study, design, replicates)
    ids = jobs.ids()
    ids = _served(study, jobs, ids, store, statuses=statuses).into(ids)
    table = jobs.rows(np.arange(len(jobs)), ids)
    return SpecVersion(
        label=str(study.path),
        name=study.name,
        counted=study.rule.counted if study.rule else "",
        spec=_values(study.document),
        code=study_code(study),
        trials=table["trial_id"].combine_chunks(),
        points=table["point"].combine_chunks(),
    )


def _served(
    study: Study,
    jobs: Jobs,
    ids: Ids,
    store: Store,
    statuses: Mapping[str, str],
) -> Served:
    """Return the trials that a launch would take from trials that record more."""
    stored_ids = KnownIds.of_column(pa.chunked_array([[*statuses]], pa.string()))
    done = [status == "done" for status in statuses.values()]
    return served(
        study,
        SomeJobs(jobs, np.flatnonzero(stored_ids.places(ids) < 0)),
        others_stored(store, study),
        stored_ids,
        done=np.array(done, np.bool_),
    )


def _values(document: Document) -> dict[str, Any]:
    values: dict[str, Any] = parse_document(document.text, document.path).value
    return values


def _overlap(before: pa.Array, after: pa.Array) -> Overlap:
    common = _among(after, before)
    return Overlap(len(after) - common, common, len(before) - common)


def _among(ids: pa.Array, stored: pa.Array) -> int:
    """Return how many of `ids` are known."""
    return int(pc.sum(pc.is_in(ids, value_set=stored), min_count=0).as_py())


def changes(before: str, after: str) -> list[Change]:
    """Return the keys in which the texts of two specs differ, with their values."""
    values = [
        parse_document(text, Path("stored spec")).value for text in (before, after)
    ]
    return list(_changes(*values))


def _changes(before: Any, after: Any, key: str = "") -> Iterator[Change]:
    """Yield the changes of mappings key by key, and of any other value as a whole."""
    if isinstance(before, dict) and isinstance(after, dict):
        for name in dict.fromkeys([*before, *after]):
            place = f"{key}.{name}" if key else name
            yield from _changes(before.get(name), after.get(name), place)
    elif json.dumps(before) != json.dumps(after):
        yield Change(key, before, after)


def _notes(before: SpecVersion, after: SpecVersion) -> Iterator[str]:
    if before.code is None or after.code is None:
        changes = ["a version before 0.7 computed the trials"]
    else:
        changes = before.code.changes(after.code)
    if changes:
        listed = ", ".join(changes)
        yield f"the code has changed ({listed}): trials with this code run again"
    renamed = list(_names(before, after))
    if renamed:
        listed = ", ".join(renamed)
        yield f"custom code has new names ({listed}): trials with these names run again"
    if before.name != after.name:
        yield (
            f"the studies have different names: {after.name} has a separate folder and"
            f" uses no trial of {before.name}"
        )
    for side in (before, after):
        if side.counted:
            yield f"{side.label}: {side.counted}"
    if (
        not changes
        and not renamed
        and not after.counted
        and before.spec == after.spec
        and _among(after.trials, before.trials) < len(after.trials)
    ):
        yield (
            "the specs are equal: a table or an image has changed, this version reads"
            " the file differently, or the first run was interrupted"
        )


def _names(before: SpecVersion, after: SpecVersion) -> Iterator[str]:
    """Yield the entries of custom code that only one version has, in words.

    Entries that a spec names are left out, because the changed keys show such entries.
    An entry that differs only in the name is `model vortex -> swirl`.
    """
    if before.code is None or after.code is None:
        return
    for kind in Code._fields[1:]:
        gone = _own_names(kind, before, after)
        new = _own_names(kind, after, before)
        entry = kind.removesuffix("s")
        for name, stamp in gone.items():
            renamed = next((other for other in new if new[other] == stamp), None)
            if renamed:
                del new[renamed]
                yield f"{entry} {name} -> {renamed}"
            else:
                yield f"{entry} {name} is gone"
        for name in new:
            yield f"{entry} {name} is new"


def _own_names(kind: str, version: SpecVersion, other: SpecVersion) -> dict[str, str]:
    """Return the code hashes of the entries of a kind that only `version` has.

    Built-in entries, and entries that the spec names, are left out.
    """
    registered = {
        *_stamps(kind, other),
        *_texts(version.spec),
        *getattr(BUILT_IN, kind),
    }
    own = _stamps(kind, version)
    return {name: stamp for name, stamp in own.items() if name not in registered}


def _stamps(kind: str, version: SpecVersion) -> dict[str, str]:
    # The key of a model is the name with the preset.
    stamps = getattr(version.code, kind).items()
    return {key.partition(" ")[0]: stamp for key, stamp in stamps}


def _texts(value: Any) -> Iterator[str]:
    """Yield all strings in a spec, at any depth."""
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
