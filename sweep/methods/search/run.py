"""One run of a search: propose candidates, race and tell, until the budget is spent.

The result does not depend on the order in which trials finish: all results of a rung
are known before any decision.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from sweep.design import Job
from sweep.errors import SpecError
from sweep.methods.search.candidates import Candidate, sampler_seed, section_of
from sweep.methods.search.known_values import KnownValues
from sweep.methods.search.objectives import Floats
from sweep.methods.search.racing import Race
from sweep.methods.search.samplers import distributions, new_study, quiet, size_of
from sweep.spec import Study, Value

if TYPE_CHECKING:
    from optuna.trial import Trial

MOST_IDLE = 1000
"""Number of candidates in a row without a new trial, after which a search ends."""


@dataclass(frozen=True, eq=False)
class RunSetup:
    """The properties that distinguish the runs of a search.

    Attributes
    ----------
    name : str
        Name of the run.
    study : Study
        Study with the seed of the run.
    sampler : str
        Name of the sampler.
    blocks : int
        Largest number of blocks of a candidate.
    level : float or None
        Level of the tests of a race; None without races.
    """

    name: str
    study: Study
    sampler: str
    blocks: int
    level: float | None

    def rungs(self) -> list[int]:
        """Return the number of blocks after each rung: 1, 2, 4, ... and the last.

        Without races there is only the last rung.
        """
        if self.level is None:
            return [self.blocks]
        doubling = [
            2**power
            for power in range(self.blocks.bit_length())
            if 2**power < self.blocks
        ]
        return [*doubling, self.blocks]


@dataclass(eq=False)
class AskedCandidate:
    """A candidate, with its trials so far.

    Attributes
    ----------
    number : int
        Index among all proposals.
    batch : int
        Number of the batch; -1 without a batch.
    candidate : Candidate
        The values of the parameters.
    trials : list of list of Job
        Trials by block and scenario.
    samples : dict of arrays, optional
        Values of the trials by column; None if a trial has no result.
    """

    number: int
    batch: int
    candidate: Candidate
    trials: list[list[Job]] = field(default_factory=list)
    samples: dict[str, Floats] | None = None

    def give(self, blocks: Iterable[int]) -> list[Job]:
        """Add the trials of some blocks, and return the added trials."""
        scenarios = range(len(self.candidate.points))
        more = [
            [self.candidate.job(block, place) for place in scenarios]
            for block in blocks
        ]
        self.trials += more
        return [job for block in more for job in block]

    def ids(self) -> list[list[str]]:
        """Return the trial ids by block and scenario."""
        return [[job.trial_id for job in block] for block in self.trials]


@dataclass(eq=False)
class Run:
    """A run of a search.

    Attributes
    ----------
    setup : RunSetup
        Study, sampler and races of the run.
    known_values : KnownValues
        Values of all trials of the search so far.
    rejected : int
        Number of proposals that the spec does not allow.
    repeated : int
        Number of proposals that were made before.
    number : int
        Number of proposals.
    idle : int
        Number of proposals in a row that brought no new candidate.
    candidates : list of AskedCandidate
        Candidates so far, in the order asked.
    spent : set of str
        Ids of the trials that count against the budget.
    by_points : dict
        Candidates by the ids of their points.
    proposed : set of tuple
        Values of all proposals.
    refusal : SpecError, optional
        The last error of a rejected proposal.
    best_so_far : str
        The best candidate after the last batch, in words.
    """

    setup: RunSetup
    known_values: KnownValues
    rejected: int = 0
    repeated: int = 0
    number: int = 0
    idle: int = 0
    candidates: list[AskedCandidate] = field(default_factory=list)
    spent: set[str] = field(default_factory=set)
    by_points: dict[tuple[str, ...], AskedCandidate] = field(default_factory=dict)
    proposed: set[tuple[Value, ...]] = field(default_factory=set)
    refusal: SpecError | None = None
    best_so_far: str = ""

    def rounds(self) -> Iterator[list[Job]]:
        """Yield the trials of each rung.

        Before the caller takes the next rung, it enters the values of the last rung in
        `known_values`. Raises SpecError if all candidates, or MOST_IDLE in a row, are
        rejected.
        """
        search = section_of(self.setup.study)
        self.optuna = new_study(
            self.setup.sampler, search, sampler_seed(self.setup.study)
        )
        self.ranges = distributions(search.parameters)
        batch = 0
        while self._left() >= 1 and not self._exhausted():
            affordable = max(1, self._left() // self.setup.rungs()[0])
            proposed = [self._ask(batch) for _ in range(min(search.batch, affordable))]
            fresh = list(
                {
                    id(candidate): candidate
                    for _, candidate in proposed
                    if candidate and not candidate.trials
                }.values()
            )
            yield from self._race(fresh)
            self._tell(proposed)
            self.best_so_far = self.leading()
            batch += 1

    def leading(self) -> str:
        """Return the best candidate so far, in words."""
        search = section_of(self.setup.study)
        race = Race(search.objectives, search.constraints, 0.0, self.setup.blocks)
        leaders = race.leaders(
            [candidate.samples for candidate in self.candidates if candidate.samples]
        )
        if not leaders:
            return "none complete yet"
        if len(search.objectives) > 1:
            return f"{len(leaders)} on the front"
        (best,) = search.objectives
        return f"best {best.column} {best.value(leaders[0][best.column]):.5g}"

    def _left(self) -> int:
        """Return the number of blocks for which the budget is enough."""
        search = section_of(self.setup.study)
        return (search.budget - len(self.spent)) // search.scenarios

    def _exhausted(self) -> bool:
        size = size_of(section_of(self.setup.study).parameters)
        ended = self.idle >= MOST_IDLE or len(self.proposed) >= size
        if ended and self.refusal and not self.candidates:
            raise SpecError(
                f"{self.refusal} ({self.idle:,} candidates in a row are rejected)"
            )
        return ended

    def _ask(self, batch: int) -> "tuple[Trial, AskedCandidate | None]":
        """Return the next proposal of the sampler, with its candidate.

        The candidate is an earlier candidate if the parameters are equal, and None if
        the spec rejects the proposal.
        """
        with quiet():
            trial = self.optuna.ask(self.ranges)
        number = self.number
        self.number += 1
        study = self.setup.study
        values: dict[str, Value] = {
            name: study.settings[name].coerce(value)
            for name, value in trial.params.items()
        }
        self.proposed.add(tuple(values.values()))
        self.idle += 1
        try:
            candidate = Candidate(study, values)
        except SpecError as error:
            self.rejected += 1
            self.refusal = error
            return trial, None
        if candidate.points in self.by_points:
            self.repeated += 1
        else:
            self.idle = 0
            self.by_points[candidate.points] = AskedCandidate(number, batch, candidate)
        return trial, self.by_points[candidate.points]

    def _race(self, fresh: list[AskedCandidate]) -> Iterator[list[Job]]:
        """Yield the trials of the candidates of a batch, rung by rung."""
        search = section_of(self.setup.study)
        setup = self.setup
        race = (
            Race(search.objectives, search.constraints, setup.level, setup.blocks)
            if setup.level
            else None
        )
        earlier = [
            candidate.samples for candidate in self.candidates if candidate.samples
        ]
        self.candidates += fresh
        running = fresh
        had = 0
        for rung in setup.rungs():
            jobs, allowed = self._allot(running, had, rung)
            yield jobs
            for candidate in running:
                candidate.samples = (
                    self.known_values.of(candidate.ids()) if candidate.trials else None
                )
            running = [candidate for candidate in running if candidate.samples]
            had = rung
            if not allowed:
                break
            if race and rung < setup.blocks:
                dropped = race.dropped(
                    earlier,
                    [candidate.samples for candidate in running if candidate.samples],
                )
                running = [
                    candidate
                    for candidate, out in zip(running, dropped, strict=True)
                    if not out
                ]

    def _allot(
        self, running: list[AskedCandidate], had: int, rung: int
    ) -> tuple[list[Job], bool]:
        """Give each candidate its blocks from `had` to `rung`, block after block.

        Returns the new trials, and whether the budget was enough.
        """
        jobs: list[Job] = []
        for block in range(had, rung):
            for candidate in running:
                if self._left() < 1:
                    return jobs, False
                new = candidate.give([block])
                self.spent.update(job.trial_id for job in new)
                jobs += new
        return jobs, True

    def _tell(self, proposed: "list[tuple[Trial, AskedCandidate | None]]") -> None:
        """Tell the sampler the results of a batch, in the order asked.

        A proposal without a result is worse than all proposals with a result.
        """
        from optuna.trial import TrialState

        search = section_of(self.setup.study)
        with quiet():
            for trial, candidate in proposed:
                if candidate is None or candidate.samples is None:
                    self.optuna.tell(trial, state=TrialState.PRUNED)
                    continue
                for place, constraint in enumerate(search.constraints):
                    trial.set_constraint(
                        str(place),
                        constraint.violation(candidate.samples[constraint.column]),
                    )
                self.optuna.tell(
                    trial,
                    [
                        objective.value(candidate.samples[objective.column])
                        for objective in search.objectives
                    ],
                )
