"""A store under the exclusive access of one launch.

Damaged parts are set aside before any trial runs.
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
    """Lock the study of `store`, or the shard `share`, and set damaged parts aside.

    Inside the context only this process launches the study or the shard, and all parts
    are intact. With a shard, several launches write the study at once. Then the
    store merges only parts of this launch, and keeps all files that another launch may
    need. The log, which goes to stderr, reports a lock that was taken over and each
    part that was set aside. SIGTERM and SIGHUP end the context as Ctrl-C does.

    Raises StoreError if another launch holds the study or the shard, or if the store
    cannot be written.
    """
    with ended_like_ctrl_c(), Lock(store.place, share) as lock:
        store.shared = share is not None
        set_aside_damaged(store)
        store.tidy()
        yield lock


def set_aside_damaged(store: Store) -> None:
    """Move damaged parts below damaged/, so that their trials count as not run.

    If a part is gone, a launch of another shard has merged or moved the part.
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
            "the number of its trials is unknown; all run again"
            if trials is None
            else f"its {trials:,} trials run again"
        )
        if store.shared:
            outcome += " with their shards"
        LOG.warning(
            "%s: damaged: %s; %s", part, flaw, f"set aside as {place}, {outcome}"
        )
