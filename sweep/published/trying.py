"""Tries variants: which verdicts of a document turn with them.

A variant turns a counted claim where it gives it another verdict. A mutant that turns a
confirmed claim is killed by it. A claim that kills none could hardly have failed.
"""

import hashlib
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from kernels.identity import kernels_sha
from sweep.campaigns.progress import Display
from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.published.details import details
from sweep.published.judging import Row, judged, stored_studies
from sweep.published.numerics import numerics
from sweep.published.publications import Publication
from sweep.published.running import run_studies
from sweep.published.turned import (
    DocumentVariants,
    Estimated,
    Turned,
    joined,
    read_turned,
    write_turned,
)
from sweep.published.variants import Kind, Variant, mutants, needed_studies
from sweep.spec.study import Study
from sweep.tables.scaling import Scaling
from sweep.text import unknown
from sweep.workers.executors import ExecutorFactory

MAKERS: Mapping[Kind, Callable[[Publication], Iterator[Variant]]] = {
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
    made = [(one, list(MAKERS[kind](one))) for one in publications if one.asked]
    names = dict.fromkeys(one.name for _, variants in made for one in variants)
    for pattern in named:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise SpecError(unknown(f"variant of the {kind}", pattern, names))
    chosen = [
        (publication, [one for one in variants if _is_named(one.name, named)])
        for publication, variants in made
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
        rows = _rows(publication, results)
        before = {
            claim: row.verdict.status for claim, row in rows.items() if _is_judged(row)
        }
        estimates = _estimates(rows)
        inputs = fingerprint(publication)
        for one in variants:
            run_studies(_changed(publication, one), results, engine, display)
            turned = _turned(one, before, _rows(one.publication, results))
            kinds = {one.kind: {one.name: turned}}
            found = DocumentVariants(inputs, before, kinds, estimates)
            known = joined(known, publication.name, found, one.kind)
            write_turned(known, results)
    return {publication.name: known[publication.name] for publication, _ in chosen}


def _changed(publication: Publication, variant: Variant) -> list[Study]:
    """The studies of a variant that are changed, and decide a verdict."""
    return [
        study
        for spec, study in needed_studies(variant.publication).items()
        if study.name != publication.studies[spec].name
    ]


def _rows(publication: Publication, results: Path) -> dict[str, Row]:
    """The rows of the counted claims by id."""
    rows, _ = judged(publication, stored_studies(publication, results))
    return {row.claim.id: row for row in rows if row.claim.counted}


def _is_judged(row: Row) -> bool:
    """Whether a row has a verdict. Without all trials, or where its measure fails, it
    says nothing.
    """
    return row.measured is not None and row.verdict.status != "partial"


def _turned(
    variant: Variant, before: Mapping[str, str], after: Mapping[str, Row]
) -> Turned:
    """What a variant turned, given the verdicts before and the rows after it."""
    unjudged = {
        claim: after[claim].verdict.reason
        for claim in before
        if not _is_judged(after[claim])
    }
    turned = {
        claim: after[claim].verdict.status
        for claim, status in before.items()
        if claim not in unjudged and after[claim].verdict.status != status
    }
    estimates = _estimates(
        {claim: after[claim] for claim in before if claim not in unjudged}
    )
    return Turned(variant.about, variant.share, turned, unjudged, estimates)


def _estimates(rows: Mapping[str, Row]) -> dict[str, Estimated]:
    """What was measured of the rows that have a finite interval, by id."""
    found = {}
    for claim, row in rows.items():
        if not _is_judged(row) or row.measured is None:
            continue
        estimate = row.measured.estimate
        if not isinstance(estimate, Scaling) and row.verdict.simultaneous:
            ours, (low, high) = estimate.value, row.verdict.simultaneous
            if math.isfinite(low) and math.isfinite(high):
                found[claim] = Estimated(
                    ours=ours, low=low, high=high, trials=row.measured.used
                )
    return found


def fingerprint(publication: Publication) -> str:
    """A hash of what decides which verdicts variants turn: the claims, specs and code
    of a publication, and the kernels.
    """
    found = hashlib.sha256(kernels_sha().encode())
    for ending in ("yaml", "py", "csv"):
        for file in sorted(publication.folder.glob(f"*.{ending}")):
            found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()
