"""What a report says of a stored search, and what its reader is warned of."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis.notation import number, percent
from sweep.campaigns.search.asked_trials import AskedTrials
from sweep.campaigns.search.held_out import differences, front, references, winners
from sweep.campaigns.search.outcome import (
    COMPLETE,
    SEARCH,
    candidates,
    objectives,
    undefined_shares,
)
from sweep.campaigns.search.repetitions import (
    RANDOM,
    REPETITION,
    AgainstRandom,
    against_random,
    runs,
)
from sweep.campaigns.search.sentences import FEWEST_BLOCKS, edges, thin_tail
from sweep.errors import ChoiceError
from sweep.spec.objectives import Objective
from sweep.tables.stored_study import StoredStudy


@dataclass(frozen=True, eq=False)
class Findings:
    """What a report says. Each part is computed when it is first asked for."""

    study: StoredStudy
    asked_trials: AskedTrials

    @cached_property
    def objectives(self) -> list[Objective]:
        return objectives(self.asked_trials)

    @cached_property
    def units(self) -> dict[str, str]:
        return self.study.units

    @cached_property
    def candidates(self) -> pd.DataFrame:
        return candidates(self.asked_trials)

    @cached_property
    def winners(self) -> pd.DataFrame:
        return winners(self.asked_trials)

    @cached_property
    def references(self) -> pd.DataFrame:
        return references(self.asked_trials)

    @cached_property
    def differences(self) -> pd.DataFrame:
        return differences(self.asked_trials)

    @cached_property
    def front(self) -> pd.DataFrame:
        """Raises ChoiceError for a search with one objective."""
        if len(self.objectives) == 1:
            raise ChoiceError(
                "a front needs two objectives and there is one", self.study.name
            )
        return front(self.asked_trials)

    @cached_property
    def against(self) -> AgainstRandom | None:
        return (
            against_random(self.asked_trials)
            if runs(self.asked_trials, REPETITION) and runs(self.asked_trials, RANDOM)
            else None
        )

    @cached_property
    def spent(self) -> int:
        rows = self.asked_trials.table[
            (self.asked_trials.table["run"] == SEARCH)
            & (self.asked_trials.table["phase"] == "search")
        ]
        return int(rows.loc[rows["status"] != "missing", "trial_id"].nunique())

    @cached_property
    def best(self) -> dict[str, Any] | None:
        """The row of the winner, or with several objectives of the knee or else the
        first of the front.
        """
        if self.winners.empty:
            return None
        place = int(self.winners["candidate"].iloc[0])
        if len(self.objectives) > 1 and self.front["knee"].any():
            place = int(self.front.loc[self.front["knee"], "candidate"].iloc[0])
        return dict(self.candidates.set_index("candidate", drop=False).loc[place])

    def settings(self, row: dict[str, Any]) -> dict[str, Any]:
        """The parameters of a candidate as plain values."""
        return {
            name: plain(row[name])
            for name in self.asked_trials.description["parameters"]
        }


def warnings(findings: Findings) -> list[str]:
    """What a reader must know before believing the rest, a sentence each."""
    description = findings.asked_trials.description
    best = findings.best
    sentences = (
        []
        if description["finished"]
        else ["The search is not finished: the same command goes on with it."]
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
            f"{few}: the budget of {description['budget']:,} trials is small for that."
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
    """A value of a table as JSON has it; None for what is not a finite number."""
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and not np.isfinite(value) else value
