"""A store in the hands of one launch: others are kept out, and what is damaged is set
aside before anything runs.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from sweep.store.lock import Lock
from sweep.store.manifest import damage, trials_of
from sweep.store.parquet import each
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.trial.interrupts import ended_like_ctrl_c

LOG = logging.getLogger("sweep")


@contextmanager
def custody(store: Store, share: Share | None = None) -> Iterator[Lock]:
    """Inside, this process alone launches the study of `store`, or its `share` of it,
    and its parts are sound.

    With a share, others write the same study at the same time. Then the store merges
    only its own parts and deletes nothing that may belong to others. The log, which
    goes to stderr, tells of a lock that was taken over and of each part set aside.
    SIGTERM and SIGHUP end what is inside like Ctrl-C. Raises StoreError where somebody
    else is launching the study, or the share, and where the store cannot be written.
    """
    with ended_like_ctrl_c(), Lock(store.place, share) as lock:
        store.shared = share is not None
        set_aside_damaged(store)
        store.tidy()
        yield lock


def set_aside_damaged(store: Store) -> None:
    """Move damaged parts below damaged/, so that their trials count as not run.

    A part that has gone meanwhile was merged or set aside by a launch of another share.
    """
    parts = store.all_parts()
    for part, what in zip(parts, each(parts, damage), strict=True):
        if not what:
            continue
        trials = trials_of(part)
        place = store.place.set_aside(part)
        if place is None:
            continue
        held = (
            "how many trials it held is not known; those"
            if trials is None
            else f"its {trials:,} trials"
        )
        again = (
            "run again"
            if not store.shared
            else "run again with the shares that they belong to"
        )
        LOG.warning(
            "%s: damaged: %s; set aside as %s, %s %s", part, what, place, held, again
        )
