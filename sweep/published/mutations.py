"""Mutants: wrong versions of the studies of a document, which its claims must notice.

Each mutant runs and is judged as the document is, at the same scale and with the same
random numbers. A counted claim that is confirmed without a mutant, and no longer with
it, kills the mutant. A claim that kills none could hardly have failed.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kernels.identity import kernels_sha
from sweep.campaigns.progress import Display
from sweep.errors import OutputError, StoreError
from sweep.published.judging import Row, judged, stored_studies
from sweep.published.measures import specs_of
from sweep.published.publications import (
    Publication,
    read_mutant,
)
from sweep.published.running import run_studies
from sweep.spec.study_folder import MUTATIONS
from sweep.store.new_files import replacing
from sweep.store.regular import read_json
from sweep.workers.executors import ExecutorFactory

VERSION = 1
MOST_BYTES = 10_000_000
SHAPE = {
    "version": int,
    "documents": {
        str: {
            "inputs": str,
            "confirmed": [str],
            "mutants": {str: {"about": str, "killed_by": [str]}},
        }
    },
}


@dataclass(frozen=True)
class Mutations:
    """What the mutants of a document turned.

    inputs     a hash of all that decides it
    confirmed  the ids of the counted claims that are confirmed without a mutant
    killed_by  by mutant the ids of those that no longer are with it
    about      by mutant what is wrong with it
    """

    inputs: str
    confirmed: Sequence[str]
    killed_by: Mapping[str, Sequence[str]]
    about: Mapping[str, str]

    @property
    def noticed(self) -> int:
        """How many mutants are killed by at least one claim."""
        return sum(bool(claims) for claims in self.killed_by.values())

    def killing(self, claim: str) -> list[str]:
        """The mutants that a claim kills."""
        return [name for name, claims in self.killed_by.items() if claim in claims]

    def summary(self) -> str:
        """How many mutants are noticed, and which are not, in words."""
        missed = [name for name, claims in self.killed_by.items() if not claims]
        killers = {claim for claims in self.killed_by.values() for claim in claims}
        return (
            f"{self.noticed} of {len(self.killed_by)} mutants are noticed;"
            f" {len(killers)} of {len(self.confirmed)} confirmed claims notice one"
            + (f"; not noticed: {', '.join(missed)}" if missed else "")
        )


def try_mutants(
    publication: Publication,
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> Mutations:
    """Run and judge a publication as it is, and each of its mutants.

        publication  at the scale at which its mutants are tried
        results      the folder with the stored studies; mutants lie apart in it
        engine       runs the trials
        display      makes the progress display of a study from its name

    Raises SpecError for a mutant with which a measure finds no trials, before any trial
    runs, and otherwise as a launch does.
    """
    wrong = [read_mutant(publication, one.name) for one in publication.mutants]
    rows = _rows(publication, results, engine, display)
    before = [name for name, row in rows.items() if row.verdict.status == "confirmed"]
    killed_by = {}
    for mutant, changed in zip(publication.mutants, wrong, strict=True):
        after = _rows(changed, results, engine, display)
        killed_by[mutant.name] = [claim for claim in before if _turned(after[claim])]
    about = {mutant.name: mutant.about for mutant in publication.mutants}
    return Mutations(fingerprint(publication), before, killed_by, about)


def try_all(
    publications: Sequence[Publication],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> dict[str, Mutations]:
    """Try the mutants of the publications that are asked for and have some, and store
    what they turned. What is stored of others stays. Raises as `try_mutants`.
    """
    known, found = read_mutations(results), {}
    for one in publications:
        if one.asked and one.mutants:
            found[one.name] = try_mutants(one, results, engine, display)
            write_mutations(known | found, results)
    return found


def _rows(
    publication: Publication,
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> dict[str, Row]:
    """The rows of the counted claims by id. Only their studies are run."""
    needed = {
        spec: publication.studies[spec]
        for claim in publication.claims
        if claim.counted and claim.measure
        for spec in specs_of(claim.measure, publication.studies)
    }
    run_studies(needed.values(), results, engine, display)
    rows, _ = judged(publication, stored_studies(publication, results))
    return {row.claim.id: row for row in rows if row.claim.counted}


def _turned(row: Row) -> bool:
    """Whether a row is no longer confirmed. Without all trials, or where its measure
    fails, it says nothing.
    """
    return row.measured is not None and row.verdict.status not in (
        "confirmed",
        "partial",
    )


def fingerprint(publication: Publication) -> str:
    """A hash of what decides which mutants a publication notices: its claims, specs and
    code, and the kernels.
    """
    found = hashlib.sha256(kernels_sha().encode())
    for ending in ("yaml", "py", "csv"):
        for file in sorted(publication.folder.glob(f"*.{ending}")):
            found.update(hashlib.sha256(file.read_bytes()).digest())
    return found.hexdigest()


def read_mutations(results: Path) -> dict[str, Mutations]:
    """What is stored of mutants below `results`, by document; nothing where they were
    not tried. Raises StoreError for a file that is damaged.
    """
    path = results / MUTATIONS
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(
            f"{path}: {error}; remove it and try the mutants again"
        ) from None
    return {
        name: Mutations(
            one["inputs"],
            one["confirmed"],
            {mutant: about["killed_by"] for mutant, about in one["mutants"].items()},
            {mutant: about["about"] for mutant, about in one["mutants"].items()},
        )
        for name, one in content["documents"].items()
    }


def write_mutations(found: Mapping[str, Mutations], results: Path) -> Path:
    """Store what mutants turned, by document. Raises OutputError."""
    documents = {
        name: {
            "inputs": one.inputs,
            "confirmed": list(one.confirmed),
            "mutants": {
                mutant: {"about": one.about[mutant], "killed_by": list(claims)}
                for mutant, claims in one.killed_by.items()
            },
        }
        for name, one in found.items()
    }
    text = json.dumps({"version": VERSION, "documents": documents}, indent=1)
    path = results / MUTATIONS
    try:
        results.mkdir(parents=True, exist_ok=True)
        with replacing(path, results) as file:
            file.write(f"{text}\n".encode())
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error})") from None
    return path
