"""The plan of any study: the trials of the next launch."""

from dataclasses import replace

import numpy as np

from sweep.campaigns.stored_trials import StoredTrials
from sweep.campaigns.warming import unlike
from sweep.design import Ids, Jobs, SomeJobs, StudyPlan, expand, make_plan
from sweep.spec import Study
from sweep.store import Earlier, Location, Store, earlier_trials, others_stored, served
from sweep.trial import compiling_seconds, layers_of, measured_pace


def plan_of(study: Study, workers: int, results: Location | None = None) -> StudyPlan:
    """Return the plan of a study.

    If trials keep their last states, the plan counts the trials that would resume from
    stored trials.

    Parameters
    ----------
    study : Study
    workers : int
        Number of workers, for the wall time.
    results : Location, optional
        Folder of stored results; without it no trial is counted as resumed.

    Raises
    ------
    SpecError
        If the design is not possible, and as `measured_pace`.
    StoreError
        If the results cannot be read.
    """
    seconds = _compiling_seconds(study)
    if study.strategy_section and (make := study.strategy_section[0].plan):
        own: StudyPlan = make(study, workers, seconds)
        return own
    plan = make_plan(study, workers, measured_pace(study))
    plan = replace(plan, compiling_seconds=seconds)
    if results is None or not study.record.last_states:
        return plan
    earlier = _earlier(study, Store(results / study.name, results))
    saved = int(earlier.steps.sum())
    return replace(plan, continued=earlier.count, steps_saved=saved)


def _compiling_seconds(study: Study) -> float:
    """Return the time to compile the kernels of all trials, in s.

    Each choice of layers is another kernel.
    """
    study = study.stand_in
    jobs = {layers_of(job): job for job in unlike(study, expand(study))}
    return sum(map(compiling_seconds, jobs.values()))


def _earlier(study: Study, store: Store) -> Earlier:
    """Return the stored trials from which missing trials of a study would resume."""
    jobs = Jobs(study, expand(study))
    stored = StoredTrials(store, (), catalogue=study.catalogue, retry=False)
    ids = jobs.ids()
    recordings = others_stored(store, study)
    missing = _missing(stored, jobs, ids)
    serving = served(study, missing, recordings, stored.ids, done=stored.done)
    return earlier_trials(study, store, _missing(stored, jobs, serving.into(ids)))


def _missing(stored: StoredTrials, jobs: Jobs, ids: Ids) -> SomeJobs:
    """Return the jobs whose `ids` are not stored."""
    _, final = stored.ask(ids)
    return SomeJobs(jobs, np.flatnonzero(~final))
