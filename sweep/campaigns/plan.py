"""The plan of any study: what a launch or a search of it would run."""

from dataclasses import replace

from sweep.campaigns.search.plan import SearchPlan, make_search_plan
from sweep.design.plan import Plan, make_plan
from sweep.spec.study import Study
from sweep.trial.probe import measured_pace
from sweep.trial.simulation import compiling_seconds


def plan_of(study: Study, workers: int) -> Plan | SearchPlan:
    """What `study` would run with so many workers.

    Raises SpecError for a design or a search that cannot be, and as `measured_pace`.
    """
    seconds = compiling_seconds(study.known.models[study.model])
    if study.search:
        search = make_search_plan(study, workers)
        return replace(search, compiling_seconds=seconds)
    plan = make_plan(study, workers, measured_pace(study))
    return replace(plan, compiling_seconds=seconds)
