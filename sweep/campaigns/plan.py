"""The plan of any study: what a launch or a search of it would run."""

from dataclasses import replace

import numpy as np

from sweep.campaigns.search.plan import SearchPlan, make_search_plan
from sweep.campaigns.stored_trials import StoredTrials
from sweep.campaigns.warming import unlike
from sweep.design.design import expand
from sweep.design.jobs import Jobs, SomeJobs
from sweep.design.plan import Plan, make_plan
from sweep.design.trial_ids import Ids
from sweep.spec.study import Study
from sweep.store.last_states import Earlier, earlier_trials
from sweep.store.locations import Location
from sweep.store.recordings import others_stored, served
from sweep.store.store import Store
from sweep.trial.probe import measured_pace
from sweep.trial.simulation import compiling_seconds, layers_of


def plan_of(
    study: Study, workers: int, results: Location | None = None
) -> Plan | SearchPlan:
    """What `study` would run with so many workers.

    Of trials that keep their last states it says how many go on from those that are
    stored below `results`. Raises SpecError for a design or a search that cannot be,
    StoreError for results that cannot be read, and as `measured_pace`.
    """
    seconds = _compiling_seconds(study)
    if study.search:
        search = make_search_plan(study, workers)
        return replace(search, compiling_seconds=seconds)
    plan = make_plan(study, workers, measured_pace(study))
    plan = replace(plan, compiling_seconds=seconds)
    if results is None or not study.record.last_states:
        return plan
    earlier = _earlier(study, Store(results / study.name, results))
    saved = int(earlier.steps.sum())
    return replace(plan, continued=earlier.count, steps_saved=saved)


def _compiling_seconds(study: Study) -> float:
    """How long it takes to compile the model, as all its trials have it: with each
    choice of layers it is another kernel. Of a search it is as in its scenarios.
    """
    if study.search:
        study = replace(study, axes=study.search.over, require=(), search=None)
    jobs = {layers_of(job): job for job in unlike(study, expand(study))}
    return sum(map(compiling_seconds, jobs.values()))


def _earlier(study: Study, store: Store) -> Earlier:
    """From which stored trials those of a study would go on that are missing."""
    jobs = Jobs(study, expand(study))
    stored = StoredTrials(store, (), retry=False)
    ids = jobs.ids()
    recordings = others_stored(store, study)
    missing = _missing(stored, jobs, ids)
    serving = served(study, missing, recordings, stored.known, done=stored.done)
    return earlier_trials(study, store, _missing(stored, jobs, serving.into(ids)))


def _missing(stored: StoredTrials, jobs: Jobs, ids: Ids) -> SomeJobs:
    """Those of the jobs, stored under `ids`, that are not."""
    _, final = stored.ask(ids)
    return SomeJobs(jobs, np.flatnonzero(~final))
