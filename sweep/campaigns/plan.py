"""The plan of any study: what a launch or a search of it would run."""

from sweep.campaigns.search.plan import SearchPlan, make_search_plan
from sweep.design.plan import Plan, make_plan
from sweep.spec.study import Study
from sweep.trial.probe import measured_pace


def plan_of(study: Study, workers: int) -> Plan | SearchPlan:
    """What `study` would run with so many workers.

    Raises SpecError for a design or a search that cannot be, and as `measured_pace`.
    """
    if study.search:
        return make_search_plan(study, workers)
    return make_plan(study, workers, measured_pace(study))
