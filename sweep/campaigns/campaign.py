"""The driver of every campaign: ask, run, look, and ask again.

A strategy requests trials, round after round. The driver runs the trials of a round
that are not stored yet. The strategy then reads the results and requests the next
round, until no trial is requested.

The plan that lists the trials of a round is stored before the trials run. So each
stored trial is in the plan, whenever the launch ends.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from sweep.campaigns.progress import Progress
from sweep.campaigns.stored_trials import StoredTrials, among
from sweep.campaigns.strategy import Origin, PlanTables, Round, Strategy
from sweep.campaigns.twins import Twins, twins
from sweep.design import Job, Recording, SomeJobs, as_texts
from sweep.store import (
    NONE_SERVED,
    Location,
    Lock,
    Share,
    Store,
    Tables,
    chains,
    continued,
    custody,
    earlier_trials,
    give_back,
    keep_code,
    launch_provenance,
    others_stored,
    served,
)
from sweep.testing import check_promises
from sweep.trial import MOST_TRIALS, Result, check_runs
from sweep.workers import Checkpoints, ExecutorFactory, Failures, run_jobs

P = TypeVar("P", bound=Progress)


def run_campaign(
    strategy: Strategy[P],
    results: Location,
    executor: ExecutorFactory,
    *,
    share: Share | None = None,
    retry: bool = False,
    report: Callable[[P], None],
) -> P:
    """Run the trials that a strategy requests and that are not stored yet.

    Damaged parts are set aside first, so that their trials run again.

    Parameters
    ----------
    strategy : Strategy
        Decides which trials of its study are requested.
    results : Location
        Folder of results; the store of the study is below it.
    executor : ExecutorFactory
        Engine that runs the trials.
    share : Share, optional
        The shard to run; by default all trials run.
    retry : bool, default False
        Run trials again that are stored but not done.
    report : callable
        Called with the progress before trials run, whenever results have come back, and
        at the end. It is also called at the beginning, if the largest number of trials
        is known then.

    Returns
    -------
    Progress
        Progress of the strategy at the end.

    Raises
    ------
    StoreError
        If another process is launching the study, or the store cannot be read or
        written.
    ChoiceError
        If the engine cannot run the trials.
    FailedTrialsError
        If more trials have failed than the spec allows. All finished trials are stored.
    KeyboardInterrupt
        After Ctrl-C, SIGTERM or SIGHUP. All finished trials are stored.
    """
    store = Store(results / strategy.study.name, results)
    with custody(store, share) as lock:
        campaign = _Campaign(
            strategy,
            store,
            executor,
            lock=lock,
            report=report,
            share=share,
        )
        campaign.run(retry=retry)
    return strategy.progress


class _Campaign(Generic[P]):
    """A campaign in the store of its study, which this process has locked."""

    def __init__(
        self,
        strategy: Strategy[P],
        store: Store,
        executor: ExecutorFactory,
        lock: Lock,
        report: Callable[[P], None],
        share: Share | None,
    ) -> None:
        self.strategy = strategy
        self.study = strategy.study
        self.store = store
        self.executor = executor
        self.lock = lock
        self.report = report
        self.share = share
        self.progress = strategy.progress
        self.origin = launch_provenance(self.study, executor.flying.device)
        self.tables = Tables(self.study, self.origin)
        self.failures = Failures(self.study, store, self.progress.most)
        self.checkpoints = Checkpoints.of(store.folder, share)
        self.spec_is_written = False
        self.served = NONE_SERVED
        self.twins: list[Twins] = []

    def run(self, *, retry: bool) -> None:
        """Run round after round, then merge the parts."""
        self.stored = StoredTrials(
            self.store,
            self.strategy.looks_at,
            catalogue=self.study.catalogue,
            retry=retry,
        )
        self.progress.apart = len(self.stored.table)
        if self.strategy.grows:
            checkpointed = self.checkpoints.trials()
            idle = among(checkpointed, self.stored.final_ids())
            self.checkpoints.keep_only(checkpointed - idle)
        if self.progress.trials:
            self.report(self.progress)
        unpublished: Callable[[Origin], PlanTables] | None = None
        for requested in self.strategy.rounds(self.stored.look):
            current = self._serve(requested)
            unpublished = current.plan
            jobs = self._missing(current, retry=retry)
            if jobs:
                self.executor.flying.check(self.study, jobs)
                if not self.spec_is_written:
                    # The plan of code that cannot run would hide what is stored.
                    check_runs(self.study, current.some(MOST_TRIALS))
                    check_promises(self.study)
                self._publish(current.plan)
                unpublished = None
            # The ids and the plan of a million trials are a hundred megabytes.
            del current, requested
            give_back()
            if jobs:
                self._run(jobs)
        if unpublished:
            self._publish(unpublished)
        self.checkpoints.keep_only(())
        self.store.compact()
        self.report(self.progress)

    def _serve(self, requested: Round) -> Round:
        """Return the round with larger stored trials in place of missing ones.

        A stored trial serves a missing trial if it is the same run and records more.
        The round then has the id of the stored trial.
        """
        serving = self.served
        if self.study.continued:  # where a link ends is found by the id of the spec
            return requested
        _, final = self.stored.ask(requested.ids)
        if not final.all() and self.recordings:
            jobs = requested.jobs_at(np.flatnonzero(~final))
            ids = self.stored.ids
            done = self.stored.done
            new = served(self.study, jobs, self.recordings, ids, done=done)
            serving = serving.also(new)
            self.twins += twins(
                self.store, self.study, jobs, self.recordings, served=new
            )
        if not len(serving):
            return requested
        if self.strategy.grows:  # its next plan lists larger trials too
            self.served = serving

        def plan(origin: Origin) -> PlanTables:
            listed, search_table = requested.plan(origin)
            if search_table is not None:
                search_table = serving.into_rows(search_table.to_reader()).read_all()
            return serving.into_rows(listed), search_table

        return replace(requested, ids=serving.into(requested.ids), plan=plan)

    @cached_property
    def recordings(self) -> list[Recording]:
        """Recordings of stored trials that belong to another spec."""
        return others_stored(self.store, self.study)

    def _missing(self, requested: Round, *, retry: bool) -> Sequence[Job]:
        """Count all trials of a round, and return the jobs that run now."""
        stored, final = self.stored.ask(requested.ids)
        ours = np.ones(len(final), np.bool_)
        if self.share:
            ours = requested.in_share(self.share)
        missing = np.flatnonzero(ours & ~final)
        self.progress.apart -= int(stored.sum())
        self.progress.count(int(ours.sum()), int((ours & final).sum()))
        if not retry:
            failed = np.isin(requested.ids, self.stored.failed_ids())
            self.failures.note_stored(as_texts(requested.ids[failed]).to_pylist())
        if not self.strategy.grows:
            self.stored.forget()
            if checkpointed := self.checkpoints.trials():
                running = requested.ids[missing]
                self.checkpoints.keep_only(among(checkpointed, running))
        return requested.jobs_at(missing)

    def _publish(self, plan: Callable[[Origin], PlanTables]) -> None:
        keep_code(self.store, self.study.catalogue)
        self.store.write_plan(*plan(self.origin))
        if not self.spec_is_written:
            self.store.write_spec(self.study.text)
            self.spec_is_written = True

    def _run(self, jobs: Sequence[Job]) -> None:
        with self._continued(jobs) as prepared:
            self.report(self.progress)
            if not len(prepared):  # all wait for unfinished links
                return
            run_jobs(
                self.study,
                prepared,
                self.store,
                self.tables,
                executor=self.executor,
                failures=self.failures,
                noted=self._note,
            )

    def _continued(self, jobs: Sequence[Job]) -> AbstractContextManager[Sequence[Job]]:
        """Prepare jobs to resume from stored last states, or to run as chains of links.

        Last states come from stored trials with fewer steps. With a continued axis, the
        jobs become chains.
        """
        if self.study.continued:
            assert isinstance(jobs, SomeJobs)
            return nullcontext(chains(self.store, jobs))
        if not self.study.record.last_states:
            return nullcontext(jobs)
        earlier = earlier_trials(self.study, self.store, jobs)
        self.progress.continued += earlier.count
        self.progress.steps_saved += int(earlier.steps.sum())
        return continued(self.store, jobs, earlier)

    def _note(self, results: list[Result]) -> None:
        if self.strategy.grows:
            self.stored.note(results)
        self.progress.statuses.update(result.status for result in results)
        self.lock.check()
        self.report(self.progress)
        for stored_twins in self.twins:
            stored_twins.check(results)
