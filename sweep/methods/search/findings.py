"""The findings of a stored search, and warnings for the readers of a report."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis import number, percent
from sweep.errors import ChoiceError
from sweep.methods.search.asked_trials import AskedTrials
from sweep.methods.search.held_out import differences, front, references, winners
from sweep.methods.search.objectives import Objective
from sweep.methods.search.outcome import (
    COMPLETE,
    SEARCH,
    candidates,
    objectives,
    undefined_shares,
)
from sweep.methods.search.repetitions import (
    RANDOM,
    REPETITION,
    AgainstRandom,
    against_random,
    runs,
)
from sweep.methods.search.sentences import FEWEST_BLOCKS, edges, thin_tail
from sweep.tables import StoredStudy


@dataclass(frozen=True, eq=False)
class Findings:
    """Findings of a search. Each finding is computed at the first use."""

    study: StoredStudy
    asked_trials: AskedTrials

    @cached_property
    def objectives(self) -> list[Objective]:
        """Objectives, in the order of the spec."""
        return objectives(self.asked_trials)

    @cached_property
    def units(self) -> dict[str, str]:
        """Units by column."""
        return self.study.units

    @cached_property
    def candidates(self) -> pd.DataFrame:
        """The table of candidates: see `sweep.methods.search.outcome.candidates`."""
        return candidates(self.asked_trials)

    @cached_property
    def winners(self) -> pd.DataFrame:
        """The table of chosen candidates by objective: see `held_out.winners`."""
        return winners(self.asked_trials)

    @cached_property
    def references(self) -> pd.DataFrame:
        """The table of references by objective: see `held_out.references`."""
        return references(self.asked_trials)

    @cached_property
    def differences(self) -> pd.DataFrame:
        """One row per winner, reference and objective: see `held_out.differences`."""
        return differences(self.asked_trials)

    @cached_property
    def front(self) -> pd.DataFrame:
        """One row per member of the Pareto front: see `held_out.front`.

        Raises ChoiceError for a search with a single objective.
        """
        if len(self.objectives) == 1:
            raise ChoiceError(
                "a front needs two objectives; the search has one", self.study.name
            )
        return front(self.asked_trials)

    @cached_property
    def against(self) -> AgainstRandom | None:
        """Repetitions against random searches; None if the search was not repeated."""
        return (
            against_random(self.asked_trials)
            if runs(self.asked_trials, REPETITION) and runs(self.asked_trials, RANDOM)
            else None
        )

    @cached_property
    def spent(self) -> int:
        """Number of trials of the main search that are stored, each counted once."""
        rows = self.asked_trials.table[
            (self.asked_trials.table["run"] == SEARCH)
            & (self.asked_trials.table["phase"] == "search")
        ]
        return int(rows.loc[rows["status"] != "missing", "trial_id"].nunique())

    @cached_property
    def best(self) -> dict[str, Any] | None:
        """The row of the winner; None without a winner.

        With several objectives the row is of the knee of the front, or else of the
        first member.
        """
        if self.winners.empty:
            return None
        place = int(self.winners["candidate"].iloc[0])
        if len(self.objectives) > 1 and self.front["knee"].any():
            place = int(self.front.loc[self.front["knee"], "candidate"].iloc[0])
        return dict(self.candidates.set_index("candidate", drop=False).loc[place])

    def settings(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the parameters of a candidate as plain values."""
        return {
            name: plain(row[name])
            for name in self.asked_trials.description["parameters"]
        }


def warnings(findings: Findings) -> list[str]:
    """Return the warnings for a reader, one sentence each."""
    description = findings.asked_trials.description
    best = findings.best
    sentences = (
        []
        if description["finished"]
        else ["The search is not finished: repeat the command to resume the search."]
    )
    sentences += [
        f"{column} has no value in {percent(share)} of the done trials; a candidate of"
        " such a trial has failed."
        for column, share in undefined_shares(findings.asked_trials).items()
    ]
    if best is None:
        return [
            *sentences,
            (
                "There is no winner: no candidate is feasible and has a result in all"
                " of its trials."
            ),
        ]
    full = description["blocks"][SEARCH]
    if best["status"] != COMPLETE:
        few = f"No candidate has all {full} blocks, the best has {best['blocks']}"
        sentences.append(
            f"{few}: the budget of {description['budget']:,} trials is too small."
        )
    judged = int(findings.winners["held_out_n"].iloc[0])
    if judged == 0:
        sentences.append(
            "No held-out trials have run: search estimates of the best are too good."
        )
    elif judged < FEWEST_BLOCKS:
        only = (
            "is 1 held-out block only"
            if judged == 1
            else f"are {judged} held-out blocks only"
        )
        sentences.append(f"There {only}: intervals are wide, or not to be trusted.")
    else:
        sentences += [
            sentence
            for objective in findings.objectives
            if (sentence := thin_tail(objective, judged))
        ]
    missing = findings.winners.drop_duplicates("candidate").set_index("candidate")[
        "not_done"
    ]
    sentences += [
        f"Candidate {who}: {count} held-out trials have no result."
        for who, count in missing.items()
        if count
    ]
    violated = findings.winners.drop_duplicates("candidate").set_index("candidate")[
        "violation"
    ]
    sentences += [
        f"Candidate {who} violates a constraint on held-out seeds, by {number(amount)}."
        for who, amount in violated.items()
        if amount > 0.0
    ]
    edge_sentences = edges(best, description["ranges"], findings.study.settings)
    return sentences + [f"{sentence}." for sentence in edge_sentences]


def plain(value: Any) -> Any:
    """Return a value of a table in JSON form; None for NaN and infinity."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not np.isfinite(value) else value
