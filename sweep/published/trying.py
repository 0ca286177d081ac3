"""A comparison of the verdicts on a publication with and without variants.

A variant turns a counted claim if the claim gets another verdict. A mutant that turns a
confirmed claim is killed by the claim. A claim that kills no mutant could hardly have
failed.
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
from sweep.campaigns import Display, Progress
from sweep.design import expand
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
from sweep.spec import Study
from sweep.store import Location
from sweep.text import unknown
from sweep.workers import ExecutorFactory, Loky, Serial

MAKERS: Mapping[Kind, Callable[[Publication], Makers]] = {
    "mutants": mutants,
    "details": details,
    "numerics": numerics,
}


def chosen_variants(
    publications: Sequence[Publication], kind: Kind, named: Collection[str] = ()
) -> list[tuple[Publication, list[Variant]]]:
    """Return the variants of a kind, by publication.

    Publications that are not selected, or have no such variants, are left out.

    Parameters
    ----------
    publications : sequence of Publication
    kind : Kind
        Kind of the variants.
    named : collection of str, default ()
        Names, or patterns such as `n-*`; () for all variants.

    Raises
    ------
    SpecError
        If no variant has a name, or in the cases of `mutants`.
    """
    available = [
        (publication, MAKERS[kind](publication))
        for publication in publications
        if publication.selected
    ]
    names = dict.fromkeys(name for _, makers in available for name in makers)
    for pattern in named:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise SpecError(unknown(f"variant of the {kind}", pattern, names))
    chosen = [
        (
            publication,
            [make() for name, make in makers.items() if _is_named(name, named)],
        )
        for publication, makers in available
    ]
    return [(publication, variants) for publication, variants in chosen if variants]


def _is_named(name: str, named: Collection[str]) -> bool:
    return not named or any(fnmatchcase(name, pattern) for pattern in named)


def most_trials(chosen: Sequence[tuple[Publication, Sequence[Variant]]]) -> int:
    """Return the number of trials of the chosen variants, without stored trials."""
    studies = [
        study
        for publication, variants in chosen
        for study in [
            *needed_studies(publication).values(),
            *(
                study
                for variant in variants
                for study in _changed(publication, variant)
            ),
        ]
    ]
    return sum(study.most_trials(expand(study).n_points) for study in studies)


def try_all(
    chosen: Sequence[tuple[Publication, Sequence[Variant]]],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> dict[str, DocumentVariants]:
    """Run and judge each publication without a change, and with each variant.

    The effects are stored after each variant. Stored effects of other variants are
    unchanged.

    Parameters
    ----------
    chosen : sequence of tuple of (Publication, sequence of Variant)
        Publications at the quick scale, each with variants of one kind.
    results : Path
        Folder with the stored studies, with separate subfolders for variants.
    engine : ExecutorFactory
        Runs the trials.
    display : callable
        Makes the progress display of a study from its name.

    Returns
    -------
    dict of str to DocumentVariants
        Effects by publication.

    Raises
    ------
    SpecError, StoreError
        In the cases of a launch.
    WorkersError
        If the copy of the program that runs a mutant fails.
    """
    turned = read_turned(results)
    for publication, variants in chosen:
        needed = needed_studies(publication).values()
        run_studies(needed, results, engine, display)
        original = _judgements(publication, results)
        before = {
            claim: judgement.status
            for claim, judgement in original.items()
            if judgement.judged
        }
        estimates = _estimates(original)
        inputs = fingerprint(publication)
        for variant in variants:
            if variant.program:
                after = _judged_by_copy(publication, variant, results, engine)
            else:
                run_studies(_changed(publication, variant), results, engine, display)
                after = _judgements(variant.publication, results)
            kinds = {variant.kind: {variant.name: _turned(variant, before, after)}}
            effects = DocumentVariants(inputs, before, kinds, estimates)
            turned = joined(turned, publication.name, effects, variant.kind)
            write_turned(turned, results)
    return {publication.name: turned[publication.name] for publication, _ in chosen}


def _changed(publication: Publication, variant: Variant) -> list[Study]:
    """Return the changed studies of a variant that matter for a verdict."""
    return [
        study
        for spec, study in needed_studies(variant.publication).items()
        if study.name != publication.studies[spec].name
    ]


class _Judgement(NamedTuple):
    """Judgement of a claim: status, reason and estimate.

    `judged` is False if the status is not a verdict. `estimate` is None without a
    finite confidence interval.
    """

    status: Status
    reason: str
    judged: bool
    estimate: Estimated | None


def _judgements(publication: Publication, results: Path) -> dict[str, _Judgement]:
    """Return the judgements of the counted claims, by id."""
    rows, _ = judged(publication, stored_studies(publication, results))
    return {
        row.claim.id: _Judgement(
            row.verdict.status, row.verdict.reason, _is_judged(row), _estimated(row)
        )
        for row in rows
        if row.claim.counted
    }


def _is_judged(row: Row) -> bool:
    """Return True if a row has a verdict.

    A row with missing trials or a failed measure has no verdict.
    """
    return row.measured is not None and row.verdict.status != "partial"


def _estimated(row: Row) -> Estimated | None:
    """Return the estimate of a row that has a finite confidence interval."""
    if not _is_judged(row) or row.measured is None or not row.verdict.simultaneous:
        return None
    estimate = row.measured.estimate
    low, high = row.verdict.simultaneous
    if isinstance(estimate, Scaling) or not math.isfinite(low + high):
        return None
    return Estimated(ours=estimate.value, low=low, high=high, trials=row.measured.used)


def _turned(
    variant: Variant, before: Mapping[str, str], after: Mapping[str, _Judgement]
) -> Turned:
    """Return the effect of a variant by verdicts before and judgements after."""
    unjudged = {
        claim: after[claim].reason for claim in before if not after[claim].judged
    }
    turned = {
        claim: after[claim].status
        for claim, status in before.items()
        if claim not in unjudged and after[claim].status != status
    }
    estimates = _estimates({claim: after[claim] for claim in before})
    return Turned(
        variant.description, variant.share, turned, unjudged, estimates=estimates
    )


def _estimates(judgements: Mapping[str, _Judgement]) -> dict[str, Estimated]:
    """Return the existing estimates, by id."""
    return {
        claim: judgement.estimate
        for claim, judgement in judgements.items()
        if judgement.estimate
    }


def _judged_by_copy(
    publication: Publication, variant: Variant, results: Path, engine: ExecutorFactory
) -> dict[str, _Judgement]:
    """Return the judgements of a copy of the program with the mistake of a variant.

    The copy runs in a separate process, in a current folder without further files.
    Raises WorkersError if the process fails.
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
        judgements = json.loads(answer.read_bytes())
    return {claim: _Judgement(*fields) for claim, fields in judgements.items()}


class _Unseen:
    """A progress display without output; the calling program shows the progress."""

    def __enter__(self) -> "_Unseen":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def show(self, progress: Progress) -> None:
        """Do not show anything."""

    def summary(self, progress: Progress, folder: Location) -> str:
        """Return the number of new trials.

        Parameters
        ----------
        progress : Progress
            Statuses of the new trials.
        folder : Location
            Folder of the study.
        """
        return f"{progress.statuses.total():,} new trials in {folder}"


def _as_copy() -> None:
    """Run and judge a publication in a mutated copy of the program.

    `_judged_by_copy` passes the arguments.
    """
    name, workers, *places = sys.argv[1:]
    folder, results, answer = map(Path, places)
    publication = read_publication(folder / FILE, quick=True)
    same = stored_studies(publication, results)
    changed = PROGRAM_MUTANTS[name].changed(needed_studies(publication), same)
    mutant = of_program(publication, name, changed)
    engine = Loky(int(workers)) if int(workers) > 1 else Serial()
    run_studies(_changed(publication, mutant), results, engine, lambda _: _Unseen())
    answer.write_text(
        json.dumps(_judgements(mutant.publication, results)), encoding="utf-8"
    )


def fingerprint(publication: Publication) -> str:
    """Return a hash of everything that influences the effects of variants.

    The hash covers the claims, specs and code of a publication, and the kernels.
    """
    digest = hashlib.sha256(kernels_sha().encode())
    for ending in ("yaml", "py", "csv"):
        for file in sorted(publication.folder.glob(f"*.{ending}")):
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


if __name__ == "__main__":
    _as_copy()
