"""Removal of unused trials, checkpoints and custom code, and merging of small parts.

If some trials of a part are removed, a merged part replaces the part and contains its
name. If all trials are removed, the part is deleted. So a process that is killed at any
moment loses no other trial. Custom code is removed after the trials that it computed,
so every stored trial has its code.
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
    rows : dict of str to array
        Ids of the removable trials, by part of the store.
    remaining : dict of str to int
        Number of trials that stay, by part.
    trials : Counter of str
        Number of removable trials by the other code that computed the trials, in words;
        "" for the code of the plan.
    size_bytes : Counter of str
        Bytes of the files of removable trials, with the keys of `trials`.
    exact : bool
        Whether `size_bytes` is exact. If a part keeps some trials, the bytes are in
        proportion to the number of trials.
    repeated : int
        Number of rows of trials that are also in a later part.
    unlisted : int
        Number of trials of the current spec and code that stay although the plan lacks
        the trials, for example after an interrupted run.
    checkpoints : set of str
        Trials with a checkpoint that no run will need.
    code : dict of str to int
        Bytes of each file of custom code that computed no remaining trial, by sha256.
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
        """True if trials or code are removable, which no launch would restore."""
        return bool(self.rows or self.code)

    def as_text(self, study: StoredStudy) -> str:
        """Return a description of the removal, which a user has to confirm."""
        roughly = "" if self.exact else "about "
        lines = [
            f"study      {study.name}",
            (
                f"stay       the stored trials of the last launched spec, which has"
                f" {study.plan.num_rows:,} trials"
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
            why = "of trials that are stored or no longer needed"
            lines.append(f"go         {count:,} checkpoints {why}")
        if self.code:
            lines.append(
                f"go         {len(self.code):,} versions of custom code, code-*.json,"
                " that computed no remaining trial:"
                f" {size(sum(self.code.values()))}"
            )
        if self.unlisted:
            why = "the run was interrupted, or a table or an image has changed"
            lines.append(
                f"stay       {so_many(self.unlisted, 'trial')} of this spec, stored but"
                f" not in the plan: {why}"
            )
        if not self.lasting and not self.checkpoints:
            lines.append("go         nothing; small parts are merged")
        if self.trials and _grows(study):
            lines.append(
                "note       the plan of this study grows during the run: complete the"
                " run first, or the removed trials may run again"
            )
        return "\n".join(lines)


def _grows(study: StoredStudy) -> bool:
    """Return whether the study chooses trials during the run."""
    return study.looks is not None or study.store.read_asked() is not None


def find_waste(study: StoredStudy) -> Waste:
    """Return the removable data in the store of `study`; change nothing.

    Raises StoreError for a damaged part.
    """
    waste = study.store.steadily(lambda parts: _waste(study, parts))
    waste.checkpoints = _idle(study)
    waste.code = study.store.steadily(lambda parts: _unused(study, parts, waste))
    return waste


def _idle(study: StoredStudy) -> set[str]:
    """Return the trials with a checkpoint that are stored or not in the plan.

    A plan that grows may still list any trial.
    """
    saved = Checkpoints.of(study.store.folder).trials()
    if not saved:
        return saved
    listed = set(study.plan["trial_id"].to_pylist())
    left = set() if _grows(study) else saved - listed
    return left | (saved & study.store.trial_ids().keys())


def _unused(study: StoredStudy, parts: list[Location], waste: Waste) -> dict[str, int]:
    """Return the bytes of each file of code that computes no trial, by sha256.

    The trials are all trials of the plan, and the remaining trials of `parts`.
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
        # Up to version 0.18 another file had the requests, which may name other trials.
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
    """Return the changes of the code of `then` from the code of `now`, in words.

    The string is "" if the code is equal.
    """
    if same_code(then, now):
        return ""
    before = stamps(then)
    after = stamps(now)
    if before and after and then["kernels_sha"] == now["kernels_sha"]:
        return f"other code: {', '.join(before.changes(after))}"
    return f"other code, {then['kernels_sha'][:16]}"


def clean(study: StoredStudy, waste: Waste) -> int:
    """Remove `waste`, merge small parts, and return the number of freed bytes.

    Raises StoreError if the study is being launched or was launched since
    `find_waste`, and if the store cannot be read or written. No other trial is lost by
    an error or by a kill of the process.
    """
    store = study.store
    checkpoints = Checkpoints.of(store.folder)
    with custody(store) as lock:
        before = _size(study, checkpoints)
        if not store.read_plan().equals(study.plan, check_metadata=True):
            raise StoreError(
                f"study {study.name} was launched meanwhile: nothing was removed;"
                " repeat the command"
            )
        checkpoints.keep_only(checkpoints.trials() - _idle(study))
        for part, trial_ids in waste.rows.items():
            lock.check()
            if part not in store.current_parts():
                raise StoreError(
                    f"study {study.name}: another process has changed the store; repeat"
                    " the command"
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
