"""A whole search: the search itself, its repetitions, and random searches.

Each run has held-out trials. The random searches serve as a comparison.
"""

from collections.abc import Callable, Iterator, Mapping

from sweep.campaigns import Look, Origin, PlanTables, Progress, Round, run_campaign
from sweep.design import Job, packed
from sweep.methods.search.asked_trials import stored_repetitions
from sweep.methods.search.candidates import (
    RANDOM,
    REPETITION,
    Candidate,
    check_candidates,
    held_out,
    references,
    repeated,
    section_of,
)
from sweep.methods.search.checks import check_trials
from sweep.methods.search.known_samplers import PLAIN
from sweep.methods.search.known_values import KnownValues
from sweep.methods.search.outcome import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    candidates,
    chosen,
)
from sweep.methods.search.phases import (
    AskedPhase,
    about_search,
    known_trials,
    plan_tables,
)
from sweep.methods.search.run import AskedCandidate, Run, RunSetup
from sweep.spec import Study
from sweep.store import Location
from sweep.workers import ExecutorFactory

RANDOM_BLOCKS = 3
"""Blocks of each candidate of a plain random search, as in published searches."""


class SearchStrategy:
    """A strategy that requests the trials of a search.

    The strategy requests the rungs of a race in order, then the held-out trials of the
    chosen candidates. The repetitions and random searches follow in the same way.
    Raises SpecError for a study that is not a search, and for a search that is not
    possible.
    """

    grows = True

    def __init__(self, study: Study, repetitions: int) -> None:
        self.study = study
        self.section = section_of(study)
        check_trials(study.document, self.section, repetitions)
        self.setups = _setups(study, repetitions)
        check_candidates(study)
        self.judging = held_out(study)
        self.references = references(self.judging)
        self.looks_at = self.section.columns
        most = self.section.most_trials(repetitions)
        self.progress = Progress(most=most, trials=most, ahead=True)
        blocks = {setup.name: setup.blocks for setup in self.setups}
        self.description = about_search(study, blocks, repetitions)
        self.phases: list[AskedPhase] = []
        self.known_values = KnownValues(self.section.columns)

    def rounds(self, look: Look) -> Iterator[Round]:
        """Yield a round per rung of each run, and a round of held-out trials per run.

        The last round has no trials, only the plan of the finished search.
        """
        for setup in self.setups:
            searched = AskedPhase(setup.name, SEARCH, [])
            self.phases.append(searched)
            run = Run(setup, self.known_values, candidates=searched.candidates)
            yield from self._new(self._search(run), look)
            yield from self._new(self._judge(searched), look)
        self.description["finished"] = True
        self.progress.trials = len(self.known_values.trials)
        rows = (row for phase in self.phases for row in phase.rows())
        self.progress.points = len({row.job.point for row in rows})
        yield self._round([])

    def _search(self, run: Run) -> Iterator[list[Job]]:
        """Yield the trials of a run, rung by rung."""
        for jobs in run.rounds():
            self._count(run)
            yield jobs
        self._count(run)

    def _count(self, run: Run) -> None:
        name = run.setup.name
        self.description["rejected"][name] = run.rejected
        self.description["repeated"][name] = run.repeated
        if run.best_so_far:
            self.progress.note = f"{name}: {run.best_so_far}"

    def _judge(self, searched: AskedPhase) -> Iterator[list[Job]]:
        """Yield the held-out trials of the candidates that a run has chosen.

        The main search includes the held-out trials of the references.
        """
        name = searched.run
        objectives = self.section.objectives
        several = name == SEARCH or len(objectives) > 1
        most = self.section.held_out.candidates if several else 1
        trials = known_trials(self.study, searched, self.known_values, self.description)
        table = candidates(trials, name)
        values = {
            searched_candidate.number: searched_candidate.candidate.values
            for searched_candidate in searched.candidates
        }
        best = {
            number: Candidate(self.judging, values[number])
            for number in chosen(table, objectives, most)
        }
        jobs = self._held_out(name, best)
        if name == SEARCH:
            jobs += self._held_out(REFERENCES, dict(enumerate(self.references)))
        yield jobs

    def _held_out(self, run: str, judged: Mapping[int, Candidate]) -> list[Job]:
        """Return all trials of candidates on held-out seeds, as a phase of a run."""
        phase = [
            AskedCandidate(number, -1, candidate)
            for number, candidate in judged.items()
        ]
        self.phases.append(AskedPhase(run, HELD_OUT, phase))
        blocks = range(self.judging.trials_per_point)
        return [
            job for judged_candidate in phase for job in judged_candidate.give(blocks)
        ]

    def _new(self, requested: Iterator[list[Job]], look: Look) -> Iterator[Round]:
        """Yield rounds of the requested trials that were not requested before."""
        for jobs in requested:
            trials = self.known_values.trials
            new = {job.trial_id: job for job in jobs if job.trial_id not in trials}
            if new:
                yield self._round(list(new.values()))
                self.known_values.enter(list(new), look())

    def _round(self, jobs: list[Job]) -> Round:
        ids = packed(job.trial_id for job in jobs)
        return Round(ids, lambda some: [jobs[place] for place in some], self._plan)

    def _plan(self, origin: Origin) -> PlanTables:
        return plan_tables(self.study, self.phases, self.description, origin)


def search_strategy(study: Study, results: Location | None) -> SearchStrategy:
    """Return the strategy of a search, with the repetitions of the stored search.

    The number is 0 if a different spec, or nothing, is stored in `results`. Raises
    SpecError for an impossible search.
    """
    return SearchStrategy(study, stored_repetitions(study, results) if results else 0)


def search(
    study: Study,
    results: Location,
    executor: ExecutorFactory,
    *,
    repetitions: int | None = None,
    retry: bool = False,
    report: Callable[[Progress], None] = lambda _progress: None,
) -> Progress:
    """Search, judge the best candidates on held-out seeds, and repeat if requested.

    Stored trials do not run again. With `retry`, only done trials count as stored.

    Parameters
    ----------
    study : Study
    results : Location
        Folder of results.
    executor : ExecutorFactory
    repetitions : int, optional
        Number of repetitions, and of random searches to compare with. By default the
        number of the stored search of this spec, or 0.
    retry : bool, default False
        Run trials again that are stored but not done.
    report : callable, optional
        Called with the progress, see `run_campaign`.

    Raises
    ------
    SpecError
        For a study that is no search, and for an impossible search.
    """
    if repetitions is None:
        strategy = search_strategy(study, results)
    else:
        strategy = SearchStrategy(study, repetitions)
    return run_campaign(strategy, results, executor, retry=retry, report=report)


def _setups(study: Study, repetitions: int) -> list[RunSetup]:
    """Return the search, its repetitions, and equally many plain random searches."""
    section = section_of(study)
    blocks = study.trials_per_point
    if repetitions and study.seeds is not None:
        message = (
            "each repetition of a search needs new seeds:"
            ' give "replicates" instead of "seeds"'
        )
        raise study.document.error(("seeds",), message)
    setups = [RunSetup(SEARCH, study, section.sampler, blocks, level=section.level)]
    for number in range(1, repetitions + 1):
        again = repeated(study, REPETITION, number)
        setups.append(
            RunSetup(
                f"repetition {number}",
                again,
                section.sampler,
                blocks,
                level=section.level,
            )
        )
    for number in range(1, repetitions + 1):
        again = repeated(study, RANDOM, number)
        setups.append(
            RunSetup(
                f"random {number}",
                again,
                PLAIN,
                min(RANDOM_BLOCKS, blocks),
                level=None,
            )
        )
    return setups
