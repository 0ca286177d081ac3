"""Effects of variants on the verdicts of publications, and the file of effects."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict

from sweep.errors import OutputError, StoreError
from sweep.published.variants import KINDS, Kind
from sweep.published.verdicts import Status
from sweep.spec import VARIANTS
from sweep.store import fits, read_json, replacing
from sweep.text import so_many

VERSION = 1
MOST_BYTES = 100_000_000
SLIGHT = 0.02
"""Fraction of a parameter up to which a change that turns a verdict is mentioned."""
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
    """Estimate of a claim, the simultaneous interval, and the number of trials."""

    ours: float
    low: float
    high: float
    trials: int


@dataclass(frozen=True)
class Turned:
    """Effect of one variant.

    Attributes
    ----------
    description : str
        Change in words.
    share : float or None
        Relative change of one parameter; None for other changes.
    turned : mapping of str to Status
        Claims with another verdict, each with the new verdict.
    unjudged : mapping of str to str
        Claims without a verdict, each with the reason.
    estimates : mapping of str to Estimated
        Estimates of the claims that have a confidence interval.
    """

    description: str
    share: float | None
    turned: Mapping[str, Status]
    unjudged: Mapping[str, str]
    estimates: Mapping[str, Estimated] = field(default_factory=dict)

    def stored(self) -> dict[str, Any]:
        """Return the fields of the effect, in the form of files and the scorecard."""
        fields = dict(vars(self))
        return {"about": fields.pop("description"), **fields}


@dataclass(frozen=True)
class DocumentVariants:
    """Effects of the variants of a publication.

    Attributes
    ----------
    inputs : str
        Hash of everything that decides the effects.
    before : mapping of str to Status
        Verdicts on the counted claims without a change, by id. Claims with missing
        trials or a failed measure are left out.
    kinds : mapping of Kind to mapping of str to Turned
        Effects of the variants by kind and name.
    estimates : mapping of str to Estimated
        Estimates of the counted claims without a change, by id.
    """

    inputs: str
    before: Mapping[str, Status]
    kinds: Mapping[Kind, Mapping[str, Turned]] = field(default_factory=dict)
    estimates: Mapping[str, Estimated] = field(default_factory=dict)

    def tried(self, kind: Kind) -> Mapping[str, Turned]:
        """Return the effects of the variants of a kind, by name."""
        return self.kinds.get(kind, {})

    def turning(self, kind: Kind, claim: str) -> dict[str, Status]:
        """Return the variants that turn a claim, each with the new verdict.

        Variants with the smallest fraction are first.

        Parameters
        ----------
        kind : Kind
            Kind of the variants.
        claim : str
            Id of the claim.
        """
        turning = {
            name: variant
            for name, variant in self.tried(kind).items()
            if claim in variant.turned
        }
        ranked = sorted(turning, key=lambda name: turning[name].share or 1.0)
        return {name: turning[name].turned[claim] for name in ranked}

    def unjudging(self, kind: Kind, claim: str) -> dict[str, str]:
        """Return the variants without a verdict on a claim, each with the reason.

        Parameters
        ----------
        kind : Kind
            Kind of the variants.
        claim : str
            Id of the claim.
        """
        return {
            name: variant.unjudged[claim]
            for name, variant in self.tried(kind).items()
            if claim in variant.unjudged
        }

    def least_share(self, claim: str) -> float | None:
        """Return the smallest relative change of one parameter that turns a claim."""
        shares = [
            variant.share
            for variant in self.tried("details").values()
            if claim in variant.turned and variant.share is not None
        ]
        return min(shares, default=None)

    @property
    def confirmed(self) -> list[str]:
        """Claims that are confirmed without a change."""
        return [name for name, status in self.before.items() if status == "confirmed"]

    @property
    def killed_by(self) -> dict[str, list[str]]:
        """By mutant, the confirmed claims that the mutant turns."""
        return {
            name: [claim for claim in self.confirmed if claim in variant.turned]
            for name, variant in self.tried("mutants").items()
        }

    @property
    def noticed(self) -> int:
        """Number of mutants that at least one claim kills."""
        return sum(bool(claims) for claims in self.killed_by.values())

    @property
    def unmoved(self) -> list[str]:
        """Mutants that change no verdict and no estimate.

        No claim depends on the mistake of such a mutant.
        """
        return [
            name
            for name, variant in self.tried("mutants").items()
            if not variant.turned
            and not variant.unjudged
            and variant.estimates == self.estimates
        ]

    def summary(self, kind: Kind) -> str:
        """Return the effect of the variants of a kind, in words."""
        summaries = {
            "mutants": self._mutants,
            "details": self._details,
            "numerics": self._numerics,
        }
        return summaries[kind]()

    def _mutants(self) -> str:
        missed = [
            self._missed(name) for name, claims in self.killed_by.items() if not claims
        ]
        killers = {claim for claims in self.killed_by.values() for claim in claims}
        return (
            f"{self.noticed} of {len(self.killed_by)} mutants are detected;"
            f" {len(killers)} of {len(self.confirmed)} confirmed claims detect a mutant"
            + (f"; not detected: {', '.join(missed)}" if missed else "")
        )

    def _missed(self, mutant: str) -> str:
        """Return a mutant that no confirmed claim detects, with the effect."""
        if mutant in self.unmoved:
            return f"{mutant} (changes no number)"
        turned = self.tried("mutants")[mutant].turned
        more = so_many(len(turned), "other claim")
        return f"{mutant} (changes {more})" if turned else mutant

    def _details(self) -> str:
        turned = [name for name in self.before if self.turning("details", name)]
        shares = [self.least_share(name) for name in turned]
        slight = sum(share is not None and share <= SLIGHT for share in shares)
        return (
            f"{len(turned)} of {len(self.before)} verdicts change with one of"
            f" {len(self.tried('details'))} details, {slight} of them with a change of"
            f" {100 * SLIGHT:g} %"
        )

    def _numerics(self) -> str:
        return "; ".join(
            f"{name} changes {len(variant.turned)} of"
            f" {len(self.before) - len(variant.unjudged)} verdicts"
            + (f" ({', '.join(variant.turned)})" if variant.turned else "")
            for name, variant in self.tried("numerics").items()
        )


def joined(
    turned: Mapping[str, DocumentVariants],
    document: str,
    new: DocumentVariants,
    kind: Kind,
) -> dict[str, DocumentVariants]:
    """Return the known effects, with the new effects of one kind.

    Effects of other inputs are dropped.

    Parameters
    ----------
    turned : mapping of str to DocumentVariants
        Known effects by publication.
    document : str
        Name of the publication.
    new : DocumentVariants
        New effects of the publication.
    kind : Kind
        Kind of the new effects.
    """
    old = turned.get(document)
    kinds = dict(old.kinds) if old and old.inputs == new.inputs else {}
    kinds[kind] = {**kinds.get(kind, {}), **new.tried(kind)}
    return {**turned, document: replace(new, kinds=kinds)}


def read_turned(results: Path) -> dict[str, DocumentVariants]:
    """Return the effects of variants that are stored below `results`, by publication.

    The mapping is empty without tried variants.

    Raises
    ------
    StoreError
        If the file is damaged.
    """
    path = results / VARIANTS
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
        return {
            name: _read(document) for name, document in content["documents"].items()
        }
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(
            f"{path}: {error}; delete the file and try the variants again"
        ) from None


def _read(document: Mapping[str, Any]) -> DocumentVariants:
    """Return the stored effects of a publication.

    Raises ValueError.
    """
    kinds = {
        kind: {
            name: Turned(
                stored["about"],
                stored["share"],
                stored["turned"],
                stored["unjudged"],
                estimates=_estimates(stored),
            )
            for name, stored in document[kind].items()
        }
        for kind in KINDS
        if document[kind]
    }
    return DocumentVariants(
        document["inputs"], document["before"], kinds, _estimates(document)
    )


def _estimates(stored: Mapping[str, Any]) -> dict[str, Estimated]:
    """Return the stored estimates; version 0.9.0 stored none.

    Raises ValueError.
    """
    estimates: dict[str, Estimated] = stored.get("estimates", {})
    if not fits(estimates, {str: ESTIMATE}):
        raise ValueError("the estimates do not have the required entries")
    return estimates


def write_turned(effects: Mapping[str, DocumentVariants], results: Path) -> None:
    """Store the effects of variants, by publication.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    documents = {
        name: {
            "inputs": document.inputs,
            "before": dict(document.before),
            "estimates": dict(document.estimates),
            **{
                kind: {
                    variant: effect.stored()
                    for variant, effect in document.tried(kind).items()
                }
                for kind in KINDS
            },
        }
        for name, document in effects.items()
    }
    text = json.dumps({"version": VERSION, "documents": documents}, indent=1)
    path = results / VARIANTS
    try:
        results.mkdir(parents=True, exist_ok=True)
        with replacing(path, results) as file:
            file.write(f"{text}\n".encode())
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error})") from None
