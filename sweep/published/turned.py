"""What the variants of documents turned, and the file that keeps it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict

from sweep.errors import OutputError, StoreError
from sweep.published.variants import KINDS, Kind
from sweep.published.verdicts import Status
from sweep.spec.study_folder import VARIANTS
from sweep.store.new_files import replacing
from sweep.store.regular import fits, read_json
from sweep.text import so_many

VERSION = 1
MOST_BYTES = 100_000_000
SLIGHT = 0.02
"""A verdict that so small a change of one setting turns says so."""
NUMBER = float | int
FIELDS: dict[str, Any] = {
    "about": str,
    "share": NUMBER | None,
    "turned": {str: str},
    "unjudged": {str: str},
}
SHAPE: dict[str, Any] = {
    "version": int,
    "documents": {
        str: {
            "inputs": str,
            "before": {str: str},
            **{kind: {str: FIELDS} for kind in KINDS},
        }
    },
}
ESTIMATE = {"ours": NUMBER, "low": NUMBER, "high": NUMBER, "trials": int}


class Estimated(TypedDict):
    """What was measured of a claim: the estimate, the bounds of the simultaneous
    interval, and the number of trials.
    """

    ours: float
    low: float
    high: float
    trials: int


@dataclass(frozen=True)
class Turned:
    """What one variant turned.

    description  what is changed, in words
    share        by which share of its value one setting is changed; None for what is
                 no such change
    turned       by id the claims with another verdict, and which
    unjudged     by id the claims on which it says nothing, and why
    estimates    by id what was measured of the claims that have an interval
    """

    description: str
    share: float | None
    turned: Mapping[str, Status]
    unjudged: Mapping[str, str]
    estimates: Mapping[str, Estimated] = field(default_factory=dict)

    def stored(self) -> dict[str, Any]:
        """The fields, as files and the scorecard have them."""
        fields = dict(vars(self))
        return {"about": fields.pop("description"), **fields}


@dataclass(frozen=True)
class DocumentVariants:
    """What the variants of a document turned.

    inputs     a hash of all that decides it
    before     the verdicts of the counted claims without a change, by id; without those
               that miss trials or whose measure fails
    kinds      by kind and name what each variant turned
    estimates  by id what was measured of these claims without a change
    """

    inputs: str
    before: Mapping[str, Status]
    kinds: Mapping[Kind, Mapping[str, Turned]] = field(default_factory=dict)
    estimates: Mapping[str, Estimated] = field(default_factory=dict)

    def tried(self, kind: Kind) -> Mapping[str, Turned]:
        """The variants of a kind."""
        return self.kinds.get(kind, {})

    def turning(self, kind: Kind, claim: str) -> dict[str, Status]:
        """The variants that turn a claim, and to which verdict, those of the smallest
        share first.
        """
        found = {
            name: one for name, one in self.tried(kind).items() if claim in one.turned
        }
        ranked = sorted(found, key=lambda name: found[name].share or 1.0)
        return {name: found[name].turned[claim] for name in ranked}

    def unjudging(self, kind: Kind, claim: str) -> dict[str, str]:
        """The variants that say nothing on a claim, and why."""
        return {
            name: one.unjudged[claim]
            for name, one in self.tried(kind).items()
            if claim in one.unjudged
        }

    def least_share(self, claim: str) -> float | None:
        """The smallest share by which the change of one setting turns a claim."""
        shares = [
            one.share
            for one in self.tried("details").values()
            if claim in one.turned and one.share is not None
        ]
        return min(shares, default=None)

    @property
    def confirmed(self) -> list[str]:
        """The claims that are confirmed without a change."""
        return [name for name, status in self.before.items() if status == "confirmed"]

    @property
    def killed_by(self) -> dict[str, list[str]]:
        """By mutant the confirmed claims that it turns."""
        return {
            name: [claim for claim in self.confirmed if claim in one.turned]
            for name, one in self.tried("mutants").items()
        }

    @property
    def noticed(self) -> int:
        """How many mutants are killed by at least one claim."""
        return sum(bool(claims) for claims in self.killed_by.values())

    @property
    def unmoved(self) -> list[str]:
        """The mutants that change no verdict and no estimate: no claim is about what is
        wrong in them.
        """
        return [
            name
            for name, one in self.tried("mutants").items()
            if not one.turned and not one.unjudged and one.estimates == self.estimates
        ]

    def summary(self, kind: Kind) -> str:
        """What the variants of a kind turn, in words."""
        words = {
            "mutants": self._mutants,
            "details": self._details,
            "numerics": self._numerics,
        }
        return words[kind]()

    def _mutants(self) -> str:
        missed = [
            self._missed(name) for name, claims in self.killed_by.items() if not claims
        ]
        killers = {claim for claims in self.killed_by.values() for claim in claims}
        return (
            f"{self.noticed} of {len(self.killed_by)} mutants are noticed;"
            f" {len(killers)} of {len(self.confirmed)} confirmed claims notice one"
            + (f"; not noticed: {', '.join(missed)}" if missed else "")
        )

    def _missed(self, mutant: str) -> str:
        """A mutant that no confirmed claim notices, and what it changes."""
        if mutant in self.unmoved:
            return f"{mutant} (changes no number)"
        turned = self.tried("mutants")[mutant].turned
        more = so_many(len(turned), "other claim")
        return f"{mutant} (turns {more})" if turned else mutant

    def _details(self) -> str:
        turned = [name for name in self.before if self.turning("details", name)]
        shares = [self.least_share(name) for name in turned]
        slight = sum(share is not None and share <= SLIGHT for share in shares)
        return (
            f"{len(turned)} of {len(self.before)} verdicts turn with one of"
            f" {len(self.tried('details'))} details, {slight} of them with a change of"
            f" {100 * SLIGHT:g} %"
        )

    def _numerics(self) -> str:
        return "; ".join(
            f"{name} turns {len(one.turned)} of"
            f" {len(self.before) - len(one.unjudged)} verdicts"
            + (f" ({', '.join(one.turned)})" if one.turned else "")
            for name, one in self.tried("numerics").items()
        )


def joined(
    known: Mapping[str, DocumentVariants],
    document: str,
    found: DocumentVariants,
    kind: Kind,
) -> dict[str, DocumentVariants]:
    """What is known, with what was found of one kind. Of other inputs nothing stays."""
    old = known.get(document)
    kinds = dict(old.kinds) if old and old.inputs == found.inputs else {}
    new = {**kinds.get(kind, {}), **found.tried(kind)}
    return {**known, document: replace(found, kinds={**kinds, kind: new})}


def read_turned(results: Path) -> dict[str, DocumentVariants]:
    """What is stored of variants below `results`, by document; nothing where none were
    tried. Raises StoreError for a file that is damaged.
    """
    path = results / VARIANTS
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
        return {name: _read(one) for name, one in content["documents"].items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(
            f"{path}: {error}; remove it and try the variants again"
        ) from None


def _read(document: Mapping[str, Any]) -> DocumentVariants:
    """What is stored of a document. Raises ValueError."""
    kinds = {
        kind: {
            name: Turned(
                one["about"],
                one["share"],
                one["turned"],
                one["unjudged"],
                estimates=_estimates(one),
            )
            for name, one in document[kind].items()
        }
        for kind in KINDS
        if document[kind]
    }
    return DocumentVariants(
        document["inputs"], document["before"], kinds, _estimates(document)
    )


def _estimates(stored: Mapping[str, Any]) -> dict[str, Estimated]:
    """What is stored of measures: version 0.9.0 stored nothing. Raises ValueError."""
    found: dict[str, Estimated] = stored.get("estimates", {})
    if not fits(found, {str: ESTIMATE}):
        raise ValueError("its estimates do not have the entries that they should")
    return found


def write_turned(found: Mapping[str, DocumentVariants], results: Path) -> None:
    """Store what variants turned, by document. Raises OutputError."""
    documents = {
        name: {
            "inputs": one.inputs,
            "before": dict(one.before),
            "estimates": dict(one.estimates),
            **{
                kind: {variant: it.stored() for variant, it in one.tried(kind).items()}
                for kind in KINDS
            },
        }
        for name, one in found.items()
    }
    text = json.dumps({"version": VERSION, "documents": documents}, indent=1)
    path = results / VARIANTS
    try:
        results.mkdir(parents=True, exist_ok=True)
        with replacing(path, results) as file:
            file.write(f"{text}\n".encode())
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error})") from None
