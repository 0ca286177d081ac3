"""Tries variants: which verdicts of a document turn with them.

A variant turns a counted claim where it gives it another verdict. A mutant that turns a
confirmed claim is killed by it. A claim that kills none could hardly have failed.
"""

import hashlib
import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from kernels.identity import kernels_sha
from sweep.campaigns.progress import Display, Progress
from sweep.design.design import expand
from sweep.errors import SpecError, WorkersError
from sweep.methods.scaling import Scaling
from sweep.published.bibliography import FILE
from sweep.published.details import details
from sweep.published.judging import Row, judged, stored_studies
from sweep.published.numerics import numerics
from sweep.published.program_mutants import PROGRAM_MUTANTS
from sweep.published.publications import Publication, read_publication
from sweep.published.running import run_studies
from sweep.published.turned import (
    DocumentVariants,
    Estimated,
    Turned,
    joined,
    read_turned,
    write_turned,
)
from sweep.published.variants import (
    Kind,
    Makers,
    Variant,
    mutants,
    needed_studies,
    of_program,
)
from sweep.published.verdicts import Status
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.text import unknown
from sweep.workers.executors import ExecutorFactory, Loky, Serial

MAKERS: Mapping[Kind, Callable[[Publication], Makers]] = {
    "mutants": mutants,
    "details": details,
    "numerics": numerics,
}


def chosen_variants(
    publications: Sequence[Publication], kind: Kind, named: Collection[str] = ()
) -> list[tuple[Publication, list[Variant]]]:
    """The variants of a kind, of the publications that are asked for and have some.

    `named` are names, or patterns such as `n-*`; without any it is all variants. Raises
    SpecError for one that no variant has, and as `mutants`.
    """
    known = [(one, MAKERS[kind](one)) for one in publications if one.selected]
    names = dict.fromkeys(name for _, makers in known for name in makers)
    for pattern in named:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise SpecError(unknown(f"variant of the {kind}", pattern, names))
    chosen = [
        (
            publication,
            [make() for name, make in makers.items() if _is_named(name, named)],
        )
        for publication, makers in known
    ]
    return [(publication, variants) for publication, variants in chosen if variants]


def _is_named(name: str, named: Collection[str]) -> bool:
    return not named or any(fnmatchcase(name, pattern) for pattern in named)


def most_trials(chosen: Sequence[tuple[Publication, Sequence[Variant]]]) -> int:
    """How many trials are run for these variants, if none is stored."""
    studies = [
        study
        for publication, variants in chosen
        for study in [
            *needed_studies(publication).values(),
            *(study for one in variants for study in _changed(publication, one)),
        ]
    ]
    return sum(study.most_trials(expand(study).n_points) for study in studies)


def try_all(
    chosen: Sequence[tuple[Publication, Sequence[Variant]]],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> dict[str, DocumentVariants]:
    """Run and judge each publication as it is, and with each variant. Store what they
    turned, variant by variant, and return it by document. What is stored of others
    stays.

        chosen   publications at the quick scale, with their variants of one kind
        results  the folder with the stored studies; variants lie apart in it
        engine   runs the trials
        display  makes the progress display of a study from its name

    Raises as a launch does.
    """
    known = read_turned(results)
    for publication, variants in chosen:
        needed = needed_studies(publication).values()
        run_studies(needed, results, engine, display)
        found = _found(publication, results)
        before = {claim: one.status for claim, one in found.items() if one.judged}
        estimates = _estimates(found)
        inputs = fingerprint(publication)
        for one in variants:
            if one.program:
                after = _found_by_copy(publication, one, results, engine)
            else:
                run_studies(_changed(publication, one), results, engine, display)
                after = _found(one.publication, results)
            kinds = {one.kind: {one.name: _turned(one, before, after)}}
            document = DocumentVariants(inputs, before, kinds, estimates)
            known = joined(known, publication.name, document, one.kind)
            write_turned(known, results)
    return {publication.name: known[publication.name] for publication, _ in chosen}


def _changed(publication: Publication, variant: Variant) -> list[Study]:
    """The studies of a variant that are changed, and decide a verdict."""
    return [
        study
        for spec, study in needed_studies(variant.publication).items()
        if study.name != publication.studies[spec].name
    ]


class _Found(NamedTuple):
    """What was found of a claim: its status and why, whether that is a verdict, and the
    estimate; None without a finite interval.
    """

    status: Status
    reason: str
    judged: bool
    estimate: Estimated | None


def _found(publication: Publication, results: Path) -> dict[str, _Found]:
    """What was found of the counted claims, by id."""
    rows, _ = judged(publication, stored_studies(publication, results))
    return {
        row.claim.id: _Found(
            row.verdict.status, row.verdict.reason, _is_judged(row), _estimated(row)
        )
        for row in rows
        if row.claim.counted
    }


def _is_judged(row: Row) -> bool:
    """Whether a row has a verdict. Without all trials, or where its measure fails, it
    says nothing.
    """
    return row.measured is not None and row.verdict.status != "partial"


def _estimated(row: Row) -> Estimated | None:
    """What was measured of a row, if it has a finite interval."""
    if not _is_judged(row) or row.measured is None or not row.verdict.simultaneous:
        return None
    estimate, (low, high) = row.measured.estimate, row.verdict.simultaneous
    if isinstance(estimate, Scaling) or not math.isfinite(low + high):
        return None
    return Estimated(ours=estimate.value, low=low, high=high, trials=row.measured.used)


def _turned(
    variant: Variant, before: Mapping[str, str], after: Mapping[str, _Found]
) -> Turned:
    """What a variant turned, given the verdicts before and what was found after it."""
    unjudged = {
        claim: after[claim].reason for claim in before if not after[claim].judged
    }
    turned = {
        claim: after[claim].status
        for claim, status in before.items()
        if claim not in unjudged and after[claim].status != status
    }
    estimates = _estimates({claim: after[claim] for claim in before})
    return Turned(variant.description, variant.share, turned, unjudged, estimates)


def _estimates(found: Mapping[str, _Found]) -> dict[str, Estimated]:
    """The estimates that there are, by id."""
    return {claim: one.estimate for claim, one in found.items() if one.estimate}


def _found_by_copy(
    publication: Publication, variant: Variant, results: Path, engine: ExecutorFactory
) -> dict[str, _Found]:
    """What a copy of the program with the mistake of a variant finds, in a process of
    its own, whose current folder has nothing else. Raises WorkersError where it fails.
    """
    assert variant.program is not None
    with TemporaryDirectory() as folder:
        variant.program.write_copy(Path(folder))
        answer = Path(folder, "found.json")
        places = publication.folder, results, answer
        paths = filter(None, [folder, os.environ.get("PYTHONPATH")])
        done = subprocess.run(
            [sys.executable, "-P", "-m", __name__, variant.name, str(engine.workers)]
            + [str(place.resolve()) for place in places],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            check=False,
        )
        if done.returncode:
            raise WorkersError(
                f"{publication.name}: the copy of the program with the mistake"
                f" {variant.name} ended with the exit code {done.returncode}"
            )
        found = json.loads(answer.read_bytes())
    return {claim: _Found(*one) for claim, one in found.items()}


class _Unseen:
    """Shows no progress: beside that of the program itself, it has no place."""

    def __enter__(self) -> "_Unseen":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def show(self, progress: Progress) -> None:
        """Show nothing."""

    def summary(self, progress: Progress, folder: Location) -> str:
        """How many trials are new."""
        return f"{progress.statuses.total():,} new trials in {folder}"


def _as_copy() -> None:
    """Run and judge the document in a folder as a mutant of the program, which this
    copy is. The arguments are those that `_found_by_copy` gives.
    """
    name, workers, *places = sys.argv[1:]
    folder, results, answer = map(Path, places)
    publication = read_publication(folder / FILE, quick=True)
    same = stored_studies(publication, results)
    changed = PROGRAM_MUTANTS[name].changed(needed_studies(publication), same)
    mutant = of_program(publication, name, changed)
    engine = Loky(int(workers)) if int(workers) > 1 else Serial()
    run_studies(_changed(publication, mutant), results, engine, lambda _: _Unseen())
    answer.write_text(json.dumps(_found(mutant.publication, results)), encoding="utf-8")


def fingerprint(publication: Publication) -> str:
    """A hash of what decides which verdicts variants turn: the claims, specs and code
    of a publication, and the kernels.
    """
    found = hashlib.sha256(kernels_sha().encode())
    for ending in ("yaml", "py", "csv"):
        for file in sorted(publication.folder.glob(f"*.{ending}")):
            found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()


if __name__ == "__main__":
    _as_copy()
