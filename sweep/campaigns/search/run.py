"""A whole search: the search itself, its repetitions and random searches to compare
with, and the held-out trials.
"""

from collections.abc import Callable

from sweep.campaigns.progress import SearchProgress
from sweep.campaigns.search.candidates import (
    RANDOM,
    REPETITION,
    Candidate,
    check_candidates,
    held_out,
    references,
    repeated,
    section_of,
)
from sweep.campaigns.search.ledger import Ledger, failed_trials, known_trials
from sweep.campaigns.search.loop import Course, Entrant, Run
from sweep.campaigns.search.outcome import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    candidates,
    chosen,
)
from sweep.campaigns.search.stored import Sheet, about_search, read_asked
from sweep.design.jobs import Job
from sweep.errors import FailedTrialsError
from sweep.spec.search_checks import check_trials
from sweep.spec.study import Study
from sweep.store.custody import custody
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.provenance import provenance
from sweep.store.rows import Tables
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result
from sweep.workers.checkpoint_folder import Checkpoints
from sweep.workers.executors import ExecutorFactory
from sweep.workers.failures import Failures

RANDOM_BLOCKS = 3
"""Blocks of each candidate of a plain random search, as published searches took."""


def search(
    study: Study,
    results: Location,
    executor: ExecutorFactory,
    *,
    repetitions: int = 0,
    retry: bool = False,
    report: Callable[[SearchProgress], None] = lambda _progress: None,
) -> SearchProgress:
    """Search, judge the best candidates on held-out seeds, and do the same for each
    repetition.

    What is stored below `results` is not run again, with `retry` only if it is done, so
    an interrupted search goes the same way. Damaged parts are set aside first, and
    their trials run again. `report` is called before the first trial, whenever trials
    have come back, and at the end. Raises SpecError for a search that cannot be,
    StoreError where another process is at work on the study and where the store cannot
    be read or written, FailedTrialsError where more trials have failed than the spec
    allows, and KeyboardInterrupt after Ctrl-C, SIGTERM or SIGHUP, both with all
    finished trials stored.
    """
    whole = _Whole(study, results, executor, repetitions, report)
    with custody(whole.ledger.store) as whole.lock:
        whole.run(retry=retry)
    return whole.progress


class _Whole:
    lock: Lock

    def __init__(
        self,
        study: Study,
        results: Location,
        executor: ExecutorFactory,
        repetitions: int,
        report: Callable[[SearchProgress], None],
    ) -> None:
        self.study, self.results, self.report = study, results, report
        self.section = section_of(study)
        check_trials(study.document, self.section, repetitions)
        self.courses = _courses(study, repetitions)
        check_candidates(study)
        self.judging = held_out(study)
        self.references = references(self.judging)
        origin, columns = provenance(study), self.section.columns
        store = Store(results / study.name, results)
        blocks = {course.name: course.blocks for course in self.courses}
        self.sheet = Sheet(
            study, store, origin, about_search(study, blocks, repetitions)
        )
        most = self.section.most_trials(repetitions)
        self.progress = SearchProgress(trials=most)
        failures = Failures(study, store, most)
        tables = Tables(study, origin)
        self.ledger = Ledger(
            study, store, tables, executor, columns, {}, self._note, failures
        )

    def run(self, *, retry: bool) -> None:
        """Everything, one run after the other, with the study's lock."""
        self.ledger.known.update(
            known_trials(self.ledger.store, self.section.columns, retry=retry)
        )
        self.ledger.failed = set() if retry else failed_trials(self.ledger.store)
        checkpoints = Checkpoints.of(self.ledger.store.folder)
        # What else the search will ask for is not known before it does.
        checkpoints.keep_only(checkpoints.trials() - self.ledger.known.keys())
        self.report(self.progress)
        for course in self.courses:
            self._judge(self._search(course))
        checkpoints.keep_only(())
        self.sheet.about["finished"] = True
        self.sheet.write()
        self.progress.trials = len(self.sheet.ids)
        if self.progress.statuses:
            self.ledger.store.compact()
        self.report(self.progress)

    def _search(self, course: Course) -> Run:
        run = Run(course, self.ledger)
        try:
            for entrants, ran in run.batches():
                self._add(course, entrants)
                self._count(run)
                if ran:
                    self.sheet.write()
        except FailedTrialsError:
            # The failed trial must be in a plan, or it could not be replayed.
            self._add(course, run.racing)
            self.sheet.write()
            raise
        self._count(run)
        self.sheet.write()
        return run

    def _add(self, course: Course, entrants: list[Entrant]) -> None:
        for entrant in entrants:
            self.sheet.add(
                course.name, SEARCH, entrant.number, entrant.batch, entrant.trials
            )

    def _count(self, run: Run) -> None:
        self.sheet.about["rejected"][run.course.name] = run.rejected
        self.sheet.about["repeated"][run.course.name] = run.repeated
        self.progress.found = f"{run.course.name}: {run.leading()}"

    def _judge(self, run: Run) -> None:
        """The held-out trials of what a run has chosen; with those of the main search
        go the references'.
        """
        name = run.course.name
        several = name == SEARCH or len(self.section.objectives) > 1
        table = candidates(read_asked(StoredStudy(self.study.name, self.results)), name)
        numbers = chosen(
            table,
            self.section.objectives,
            self.section.held_out.candidates if several else 1,
        )
        values = {entrant.number: entrant.candidate.values for entrant in run.asked}
        judged = [
            (name, number, Candidate(self.judging, values[number]))
            for number in numbers
        ]
        if name == SEARCH:
            judged += [
                (REFERENCES, place, candidate)
                for place, candidate in enumerate(self.references)
            ]
        trials = [
            (whose, number, _all_trials(candidate))
            for whose, number, candidate in judged
        ]
        self.ledger.run(
            job for _, _, blocks in trials for block in blocks for job in block
        )
        for whose, number, blocks in trials:
            self.sheet.add(whose, HELD_OUT, number, -1, blocks)
        self.sheet.write()

    def _note(self, results: list[Result]) -> None:
        self.progress.statuses.update(result.status for result in results)
        self.progress.stored = len(self.ledger.reused)
        self.lock.check()
        self.report(self.progress)


def _courses(study: Study, repetitions: int) -> list[Course]:
    """The search, its repetitions, and as many plain random searches."""
    section, blocks = section_of(study), study.trials_per_point
    if repetitions and study.seeds is not None:
        message = (
            "repetitions of a search need seeds of their own:"
            ' give "replicates" instead of "seeds"'
        )
        raise study.document.error(("seeds",), message)
    courses = [Course(SEARCH, study, section.sampler, blocks, section.level)]
    for number in range(1, repetitions + 1):
        again = repeated(study, REPETITION, number)
        courses.append(
            Course(
                f"repetition {number}", again, section.sampler, blocks, section.level
            )
        )
    for number in range(1, repetitions + 1):
        again = repeated(study, RANDOM, number)
        courses.append(
            Course(
                f"random {number}", again, "random", min(RANDOM_BLOCKS, blocks), None
            )
        )
    return courses


def _all_trials(candidate: Candidate) -> list[list[Job]]:
    blocks = candidate.jobs.study.trials_per_point
    return [
        [candidate.job(block, place) for place in range(len(candidate.points))]
        for block in range(blocks)
    ]
