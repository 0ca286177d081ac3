"""A store in the hands of one launch: others are kept out, and what is damaged is set aside before anything runs."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sweep.interrupts import ended_like_ctrl_c
from sweep.lock import Lock
from sweep.manifest import damage, trials_of
from sweep.parquet import StoreError, refuse_links
from sweep.store import Store

LOG = logging.getLogger("sweep")


@contextmanager
def custody(store: Store) -> Iterator[Lock]:
    """Inside, this process alone launches the study of `store`, whose parts are sound.

    A lock taken over, and each part set aside, are said on the log, which goes to stderr. SIGTERM and SIGHUP end what
    is inside like Ctrl-C. Raises StoreError where somebody else is launching the study, and where the store cannot be
    written.
    """
    with ended_like_ctrl_c(), Lock(store.folder, store.staging) as lock:
        set_aside_damaged(store)
        store.tidy()
        yield lock


def set_aside_damaged(store: Store) -> None:
    """Move the parts that are damaged below damaged, so that what they held counts as not run."""
    for part in store.all_parts():
        what = damage(part)
        if not what:
            continue
        place, trials = store.folder / "damaged" / part.name, trials_of(part)
        _move(store, part, place)
        held = "how many trials it held is not known; those" if trials is None else f"its {trials:,} trials"
        LOG.warning("%s: damaged: %s; set aside as %s, %s run again", part, what, place, held)


def _move(store: Store, part: Path, place: Path) -> None:
    refuse_links(store.folder)
    try:
        place.parent.mkdir(exist_ok=True)
        part.rename(place)
    except OSError as error:
        raise StoreError(f"{part}: is damaged, and cannot be set aside as {place} ({error})") from error
