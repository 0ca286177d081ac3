"""A store in the hands of one launch.

Others are kept out, and damaged parts are set aside before anything runs.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from sweep.store.lock import Lock
from sweep.store.manifest import damage, trials_of
from sweep.store.parquet import each
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.trial import ended_like_ctrl_c

LOG = logging.getLogger("sweep")


@contextmanager
def custody(store: Store, share: Share | None = None) -> Iterator[Lock]:
    """Hold the study of `store`, or its shard `share`, and set its damaged parts aside.

    Inside, this process alone launches the study or the shard, and its parts are sound.
    With a shard, others write the same study at the same time. Then the store merges
    only its own parts and deletes nothing that may belong to others. The log, which
    goes to stderr, reports a lock that was taken over and each part set aside. SIGTERM
    and SIGHUP end the context as Ctrl-C does.

    Raises StoreError if somebody else is launching the study, or the shard, and if the
    store cannot be written.
    """
    with ended_like_ctrl_c(), Lock(store.place, share) as lock:
        store.shared = share is not None
        set_aside_damaged(store)
        store.tidy()
        yield lock


def set_aside_damaged(store: Store) -> None:
    """Move damaged parts below damaged/, so that their trials count as not run.

    A part that has gone meanwhile was merged or set aside by a launch of another shard.
    """
    parts = store.all_parts()
    for part, flaw in zip(parts, each(parts, damage), strict=True):
        if not flaw:
            continue
        trials = trials_of(part)
        place = store.place.set_aside(part)
        if place is None:
            continue
        outcome = (
            "how many trials it held is not known; those run again"
            if trials is None
            else f"its {trials:,} trials run again"
        )
        if store.shared:
            outcome += " with the shares that they belong to"
        LOG.warning(
            "%s: damaged: %s; %s", part, flaw, f"set aside as {place}, {outcome}"
        )
