"""Chains of stored trials in the plan of a study.

Each link begins at the end of the previous link of the chain.
"""

from collections import Counter

from sweep.spec import PARENT
from sweep.tables.stored_study import StoredStudy


def cut_off(study: StoredStudy) -> Counter[str]:
    """Return the number of links that cannot run, by the status of the blocking link.

    The blocking link is an earlier link of the chain that is not done.
    """
    blocked = Counter[str]()
    if PARENT not in study.plan.column_names:
        return blocked
    listed = study.plan.select(["trial_id", PARENT]).to_pydict()
    after = dict(zip(listed[PARENT], listed["trial_id"], strict=True))
    stored = study.store.trial_ids()
    for trial in listed["trial_id"]:
        status = stored.get(trial, "done")
        link = after.get(trial)
        while status != "done" and link and link not in stored:
            blocked[status] += 1
            link = after.get(link)
    return blocked
