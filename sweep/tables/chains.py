"""Chains of stored trials, as the plan of a study has them: each link begins where the
one before has ended.
"""

from collections import Counter

from sweep.spec.continuing import PARENT
from sweep.tables.stored_study import StoredStudy


def cut_off(study: StoredStudy) -> Counter[str]:
    """How many links of the spec can not run, since one before them did not come to its
    end, by the status of that one.
    """
    found = Counter[str]()
    if PARENT not in study.plan.column_names:
        return found
    listed = study.plan.select(["trial_id", PARENT]).to_pydict()
    after = dict(zip(listed[PARENT], listed["trial_id"], strict=True))
    stored = study.store.trial_ids()
    for trial in listed["trial_id"]:
        status, link = stored.get(trial, "done"), after.get(trial)
        while status != "done" and link and link not in stored:
            found[status] += 1
            link = after.get(link)
    return found
