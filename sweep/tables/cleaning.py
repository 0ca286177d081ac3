"""Removal of unused trials, checkpoints and custom code, and merging of small parts.

A part that loses some of its trials is replaced by a merged part, which names it. A
part that loses all of its trials is deleted. So a process that is killed at any moment
loses no trial that stays. Code is removed after the trials that it computed, so no
stored trial is ever without its code.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from sweep.design import size
from sweep.errors import StoreError
from sweep.store import (
    Location,
    codes_of,
    custody,
    each,
    forget_code,
    kept_code,
    load_table,
    part_provenance,
    same_code,
    stamps,
    stored_schema,
    superseded_rows,
)
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many
from sweep.workers import Checkpoints


@dataclass
class Waste:
    """Stored data that could be removed.

    Attributes
    ----------
    rows
        Ids of the trials whose rows could go, by part of the store.
    remaining
        Number of trials that stay in each of these parts.
    trials
        Number of trials by the other code that computed them, in words; "" for the code
        of the plan.
    size_bytes
        Bytes of the files of these trials, by the same keys.
    exact
        Whether `size_bytes` is exact. If a part keeps some trials, the bytes are in
        proportion to its trials.
    repeated
        Number of rows of trials that a later part has too.
    unlisted
        Number of trials that stay although the plan lacks them. They have its spec and
        code, such as trials of a run that has not come to its end.
    checkpoints
        Trials whose checkpoints no run will need.
    code
        Bytes of each file of custom code that computed no trial that stays, by sha256.
    """

    rows: dict[Location, pa.ChunkedArray] = field(default_factory=dict)
    remaining: dict[Location, int] = field(default_factory=dict)
    trials: Counter[str] = field(default_factory=Counter)
    size_bytes: Counter[str] = field(default_factory=Counter)
    exact: bool = True
    repeated: int = 0
    unlisted: int = 0
    checkpoints: set[str] = field(default_factory=set)
    code: dict[str, int] = field(default_factory=dict)

    @property
    def lasting(self) -> bool:
        """True if trials or code could go, which no launch would bring back."""
        return bool(self.rows or self.code)

    def as_text(self, study: StoredStudy) -> str:
        """Return a description for a user who has to confirm the removal."""
        roughly = "" if self.exact else "about "
        lines = [
            f"study      {study.name}",
            (
                f"stay       those of the {study.plan.num_rows:,} trials of the spec as"
                " last launched that are stored"
            ),
        ]
        for other, count in self.trials.most_common():
            why = f"were computed by {other}" if other else "have left the spec"
            lines.append(
                f"go         {so_many(count, 'trial')} that {why}:"
                f" {roughly}{size(self.size_bytes[other])}"
            )
        if self.repeated:
            lines.append(
                f"go         {self.repeated:,} repeated rows,"
                " of trials that were run again since"
            )
        if self.checkpoints:
            count = len(self.checkpoints)
            why = "of trials that are stored, or that nobody will ask for"
            lines.append(f"go         {count:,} checkpoints {why}")
        if self.code:
            lines.append(
                f"go         {len(self.code):,} versions of your own code, code-*.json,"
                " by which no trial that stays was computed:"
                f" {size(sum(self.code.values()))}"
            )
        if self.unlisted:
            why = "it was not run to its end, or a table or an image has changed"
            lines.append(
                f"stay       {so_many(self.unlisted, 'trial')} stored under this very"
                f" spec that its plan lacks: {why}"
            )
        if not self.lasting and not self.checkpoints:
            lines.append("go         nothing; small parts are merged")
        if self.trials and _grows(study):
            lines.append(
                "note       the plan of this study grows as it runs: run it to its end"
                " first, or it may need them again"
            )
        return "\n".join(lines)


def _grows(study: StoredStudy) -> bool:
    """Return whether the study decides as it runs which trials it has."""
    return study.looks is not None or study.store.read_asked() is not None


def find_waste(study: StoredStudy) -> Waste:
    """Return the data that could go from the store of `study`; change nothing.

    Raises StoreError for a damaged part.
    """
    waste = study.store.steadily(lambda parts: _waste(study, parts))
    waste.checkpoints = _idle(study)
    waste.code = study.store.steadily(lambda parts: _unused(study, parts, waste))
    return waste


def _idle(study: StoredStudy) -> set[str]:
    """Return the trials with a checkpoint that are stored, or not listed by the plan.

    A plan that grows may still list any trial.
    """
    saved = Checkpoints.of(study.store.folder).trials()
    if not saved:
        return saved
    listed = set(study.plan["trial_id"].to_pylist())
    left = set() if _grows(study) else saved - listed
    return left | (saved & study.store.trial_ids().keys())


def _unused(study: StoredStudy, parts: list[Location], waste: Waste) -> dict[str, int]:
    """Return the bytes of each file of code that computes no trial, by its sha256.

    Trials are those of the plan, and those of `parts` that stay.
    """
    if not (stored := kept_code(study.store)):
        return stored
    origins = [
        part_provenance(stored_schema(part / "trials.parquet"), part / "trials.parquet")
        for part in parts
        if waste.remaining.get(part, True)
    ]
    used = codes_of([study.provenance, *origins])
    return {sha: stored[sha] for sha in stored.keys() - used}


def _waste(study: StoredStudy, parts: list[Location]) -> Waste:
    waste = Waste()
    superseded = superseded_rows(parts)
    listed = study.plan["trial_id"].combine_chunks()
    if (requests := study.store.read_asked()) is not None:
        # Up to version 0.18 it was another file, which may name other trials.
        listed = pa.concat_arrays([listed, requests["trial_id"].combine_chunks()])
    tables = each(parts, lambda part: load_table(part, "trials", ["trial_id"]))
    for part, trials in zip(parts, tables, strict=True):
        ids = trials["trial_id"]
        provenance = part_provenance(trials.schema, part / "trials.parquet")
        stale = pc.is_in(ids, value_set=superseded.get(part, pa.array([], pa.string())))
        left = pc.and_not(pc.invert(pc.is_in(ids, value_set=listed)), stale)
        other = _other_code(provenance, study.provenance)
        if provenance["spec"] == study.spec and not other:
            waste.unlisted += _count(left)
            left = pc.and_(left, False)
        going = pc.or_(left, stale)
        if _count(going):
            waste.rows[part] = ids.filter(going)
            waste.remaining[part] = len(ids) - _count(going)
            waste.repeated += _count(stale)
            waste.trials[other] += _count(left)
            waste.size_bytes[other] += round(_bytes(part) * _count(left) / len(ids))
            waste.exact &= waste.remaining[part] == 0
    waste.trials = +waste.trials
    return waste


def _other_code(then: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return the code other than that of `now` that computed trials, in words.

    It is "" if the code is the same.
    """
    if same_code(then, now):
        return ""
    before = stamps(then)
    after = stamps(now)
    if before and after and then["kernels_sha"] == now["kernels_sha"]:
        return f"other code: {', '.join(before.changes(after))}"
    return f"other kernels, {then['kernels_sha'][:16]}"


def clean(study: StoredStudy, waste: Waste) -> int:
    """Remove `waste`, merge small parts, and return how many bytes that saved.

    Raises StoreError if the study is being launched or was launched since
    `find_waste`, and if the store cannot be read or written. No trial that stays is
    lost by an error, nor if the process is killed.
    """
    store = study.store
    checkpoints = Checkpoints.of(store.folder)
    with custody(store) as lock:
        before = _size(study, checkpoints)
        if not store.read_plan().equals(study.plan, check_metadata=True):
            raise StoreError(
                f"study {study.name} was launched meanwhile: nothing was removed;"
                " look again"
            )
        checkpoints.keep_only(checkpoints.trials() - _idle(study))
        for part, trial_ids in waste.rows.items():
            lock.check()
            if part not in store.current_parts():
                raise StoreError(
                    f"study {study.name}: its store was changed meanwhile; look again"
                )
            if waste.remaining[part]:
                store.merge([part], {part: trial_ids.combine_chunks()})
            else:
                store.discard(part)
        store.compact()
        for sha in _unused(study, store.current_parts(), Waste()):
            lock.check()
            if sha in waste.code:
                forget_code(store, sha)
        return before - _size(study, checkpoints)


def _size(study: StoredStudy, checkpoints: Checkpoints) -> int:
    """Return the bytes of the parts that count, of checkpoints, and of code."""
    parts = study.store.current_parts()
    code = kept_code(study.store)
    return sum(map(_bytes, parts)) + checkpoints.size() + sum(code.values())


def _count(mask: pa.ChunkedArray) -> int:
    return int(pc.sum(mask, min_count=0).as_py())


def _bytes(part: Location) -> int:
    return sum(file.stat().st_size for file in part.iterdir())
