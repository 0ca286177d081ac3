"""A checked `search` section: what is searched for, among what, and how much it may
cost.
"""

from dataclasses import dataclass

import numpy as np

from sweep.spec.axes import Axis
from sweep.spec.document import Place
from sweep.spec.objectives import Constraint, Objective
from sweep.spec.settings import Value

HELD_OUT_CANDIDATES, HELD_OUT_REPLICATES = 5, 40


@dataclass(frozen=True)
class Parameter:
    """A setting that the search varies: `form` is one of
    sweep.spec.search_section.FORMS, `arguments` are its bounds, or the values to
    choose.
    """

    name: str
    form: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class HeldOut:
    """How many candidates are judged on new seeds at the end, and with how many
    replicates.
    """

    candidates: int = HELD_OUT_CANDIDATES
    replicates: int = HELD_OUT_REPLICATES


@dataclass(frozen=True, eq=False)
class Search:
    """A checked `search` section.

    `level` is that of the tests by which candidates are dropped, None where all get all
    of their blocks. `over` are the axes of the scenarios. `references` are settings of
    all parameters by name.
    """

    parameters: tuple[Parameter, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    budget: int
    sampler: str
    batch: int
    level: float | None
    over: tuple[Axis, ...]
    held_out: HeldOut
    references: dict[str, dict[str, Value]]

    @property
    def scenarios(self) -> int:
        """The number of scenarios."""
        return int(np.prod([len(axis) for axis in self.over], dtype=np.int64))

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of trials that decide, each once."""
        objectives = [objective.column for objective in self.objectives]
        return tuple(
            dict.fromkeys(
                [*objectives, *(constraint.column for constraint in self.constraints)]
            )
        )

    def held_out_trials(self, repetitions: int) -> int:
        """The most trials on held-out seeds: of the best candidates and the references,
        and a winner a further run.
        """
        several = self.held_out.candidates if len(self.objectives) > 1 else 1
        settings = (
            self.held_out.candidates + len(self.references) + 2 * repetitions * several
        )
        return settings * self.held_out.replicates * self.scenarios

    def most_trials(self, repetitions: int) -> int:
        """The most trials of the search, with repetitions
        and as many random searches.
        """
        return (1 + 2 * repetitions) * self.budget + self.held_out_trials(repetitions)

    def place_of(self, setting: str) -> Place | None:
        """Where in the spec the search gives a setting its values; None where it does
        not.
        """
        if any(parameter.name == setting for parameter in self.parameters):
            return ("search", "parameters", setting)
        return next(
            (
                ("search", "over", axis.name)
                for axis in self.over
                if setting in axis.columns
            ),
            None,
        )
