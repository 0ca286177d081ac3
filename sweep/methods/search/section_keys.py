"""A checked `search` section: the objectives, the candidates and the budget."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from sweep.methods.search.known_samplers import FOR_ONE, FOR_SEVERAL, SEARCH_SAMPLERS
from sweep.methods.search.objectives import Constraint, Objective
from sweep.methods.search.schema import (
    constraints_schema,
    objectives_schema,
    ranges_schema,
)
from sweep.spec import (
    ANY_METRIC,
    MOST_SEARCHED,
    Axis,
    Content,
    Entry,
    EntryOf,
    Key,
    Number,
    ReadLater,
    Schema,
    SectionOf,
    Truth,
    Value,
    Whole,
    read_section,
    section_schema,
)

LEVEL = 0.1
MOST_BATCH = 10_000
SEARCHED = Whole(1, MOST_SEARCHED)


@dataclass(frozen=True)
class Parameter:
    """A parameter that the search varies.

    `form` is a bounded entry of DISTRIBUTIONS. `arguments` are the bounds, or the
    values to choose from.
    """

    name: str
    form: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class HeldOut:
    """The number of candidates judged on new seeds at the end, and their replicates."""

    candidates: Annotated[
        int,
        Key(
            SEARCHED,
            "number of best candidates to judge, in addition to the references",
        ),
    ] = 5
    replicates: Annotated[
        int, Key(SEARCHED, "trials per judged candidate and scenario")
    ] = 40


BEST = HeldOut()


@dataclass(frozen=True)
class RaceLevel:
    """The mapping under `racing`."""

    level: Annotated[
        float,
        Key(
            Number(above=0, below=0.5),
            "significance level of the tests that drop candidates",
            example="0.05",
        ),
    ]


@dataclass(frozen=True)
class Racing(Content[float | None]):
    """The level of the tests that drop candidates; None for no test."""

    @property
    def words(self) -> str:
        """The allowed values, in words."""
        return "true, false or {level: a number}"

    def read(self, entry: Entry) -> float | None:
        """Return the level that an entry writes. Raises SpecError."""
        if isinstance(entry.value, bool):
            return LEVEL if entry.value else None
        if not isinstance(entry.value, dict):
            raise entry.expected(self.words)
        return read_section(RaceLevel, entry).level

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return {"anyOf": [Truth().schema(), section_schema(RaceLevel)]}

    def write(self, value: float | None) -> Any:
        """Return the level in the form of a spec: a boolean, or a mapping."""
        return value is not None if value in (LEVEL, None) else {"level": value}

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes whose keys may appear below this class."""
        return (RaceLevel,)


@dataclass(frozen=True, eq=False, kw_only=True)
class Search:
    """A checked `search` section, whose keys are its fields.

    `level` is the level of the tests that drop candidates, None if no candidate is
    dropped. `over` has the axes of the scenarios. `references` has values of all
    parameters, by name.
    """

    parameters: Annotated[
        tuple[Parameter, ...],
        Key(
            ReadLater("parameters with ranges", ranges_schema),
            "parameters, each with a search range",
            example="{n: {integers: [10, 100]}}",
        ),
    ]
    objectives: Annotated[
        tuple[Objective, ...],
        Key(
            ReadLater(
                "metrics, each with {minimize: ...} or {maximize: ...}",
                objectives_schema,
            ),
            "metrics at the last frame, or `<metric>_mean` over the second half",
            example=f"{{{ANY_METRIC}: {{maximize: mean}}}}",
        ),
    ]
    constraints: Annotated[
        tuple[Constraint, ...],
        Key(
            ReadLater(
                "metrics, each with {at_most: ...} or {at_least: ...}",
                constraints_schema,
            ),
            "bounds of metrics",
            otherwise="none",
            example=f"{{{ANY_METRIC}: {{at_most: 1, statistic: worst}}}}",
        ),
    ]
    budget: Annotated[
        int,
        Key(
            SEARCHED,
            "most trials of the search, without trials on held-out seeds",
            example="600",
        ),
    ]
    sampler: Annotated[
        str,
        Key(
            EntryOf("sampler", SEARCH_SAMPLERS),
            "sampler that proposes candidates",
            otherwise=f"{FOR_ONE}, for several objectives {FOR_SEVERAL}",
            example="nsga3",
        ),
    ]
    batch: Annotated[
        int, Key(Whole(1, MOST_BATCH), "candidates per batch", example="24")
    ] = 12
    level: Annotated[
        float | None,
        Key(
            Racing(),
            "early stop of candidates that are clearly worse;"
            f" true is {{level: {LEVEL:g}}}",
            name="racing",
            example="false",
        ),
    ] = LEVEL
    over: Annotated[
        tuple[Axis, ...],
        Key(
            ReadLater("axes by name, as under `sweep`"),
            "axes of the scenarios in which each candidate is evaluated",
            otherwise="a single scenario",
            example="{steps: [500, 1000]}",
        ),
    ]
    held_out: Annotated[
        HeldOut,
        Key(
            SectionOf(HeldOut),
            "candidates to judge on new seeds, and their replicates",
            otherwise=f"the {BEST.candidates} best, with {BEST.replicates} replicates",
            example="{replicates: 100}",
        ),
    ] = BEST
    references: Annotated[
        dict[str, dict[str, Value]],
        Key(
            ReadLater("names, each with a value for every parameter", ranges_schema),
            "named sets of values of all parameters that are judged too",
            otherwise="none",
            example="{published: {n: 50}}",
        ),
    ]

    @property
    def scenarios(self) -> int:
        """The number of scenarios."""
        return int(np.prod([len(axis) for axis in self.over], dtype=np.int64))

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of trials that decide, without repetition."""
        objectives = [objective.column for objective in self.objectives]
        return tuple(
            dict.fromkeys(
                [*objectives, *(constraint.column for constraint in self.constraints)]
            )
        )

    def held_out_trials(self, repetitions: int) -> int:
        """Return the largest number of trials on held-out seeds.

        The number includes trials of the best candidates, of the references, and of the
        winners of each repetition and random search.
        """
        several = self.held_out.candidates if len(self.objectives) > 1 else 1
        settings = (
            self.held_out.candidates + len(self.references) + 2 * repetitions * several
        )
        return settings * self.held_out.replicates * self.scenarios

    def most_trials(self, repetitions: int) -> int:
        """Return the largest number of trials with repetitions.

        Each repetition comes with a random search.
        """
        return (1 + 2 * repetitions) * self.budget + self.held_out_trials(repetitions)
