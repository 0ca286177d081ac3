"""Stored studies as they are now: each is read once, and again when something of it was
stored since.
"""

import hashlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.spec.recorded import Column
from sweep.spec.study_folder import PLAN, STUDY_NAME, why_no_name
from sweep.store.locations import Location
from sweep.store.places import StudyPlace, place_of
from sweep.tables.search_phases import by_phase
from sweep.tables.stored_study import StoredStudy

MOST_KEPT = 4
"""So many studies are kept in memory, those that were asked for last."""
LOOKED_BACK = 60.0


class Revised(NamedTuple):
    """A study as it was at a revision, and what was read of its trials by then: by the
    metrics that it has.
    """

    revision: str
    study: StoredStudy
    narrow: dict[tuple[str, ...], StoredStudy]


class Watched:
    """The studies in a folder or an object store. Any thread may ask."""

    def __init__(self, results: Location, *, trust: bool = False) -> None:
        self.results, self.trust = results, trust
        self._seen: OrderedDict[str, Revised] = OrderedDict()
        self._lock = threading.Lock()
        self._looks: dict[str, list[tuple[float, int]]] = {}

    def narrow(self, name: str, metrics: Sequence[str] = ()) -> StoredStudy:
        """A study with what points need of its trials, and these metrics; all that are
        recorded where none are named. The phases of a search are apart. Raises as
        StoredStudy.
        """
        return self.at(name, metrics)[1]

    def at(self, name: str, metrics: Sequence[str] = ()) -> tuple[str, StoredStudy]:
        """The same with its revision."""
        plain = [Column.read(text.rstrip("+-")).metric for text in metrics]
        return self._narrow(name, lambda study: plain or study.metrics)

    def _narrow(
        self, name: str, metrics: Callable[[StoredStudy], Sequence[str]]
    ) -> tuple[str, StoredStudy]:
        seen = self._study(name)
        wanted = tuple(dict.fromkeys(metrics(seen.study)))
        with self._lock:
            if wanted not in seen.narrow:
                seen.narrow[wanted] = by_phase(seen.study.narrow(wanted))
            return seen.revision, seen.narrow[wanted]

    def counted(self, name: str) -> tuple[str, StoredStudy]:
        """A study with what its trials are and how they ended, but no metric; and its
        revision. Raises as StoredStudy.
        """
        return self._narrow(name, lambda _: ())

    def whole(self, name: str) -> StoredStudy:
        """A study with all that is stored of its trials; the phases of a search are
        apart. Raises as StoredStudy.
        """
        seen = self._study(name)
        with self._lock:
            return by_phase(seen.study)

    def _study(self, name: str) -> Revised:
        with self._lock:
            revision = self.revision(name)
            known = self._seen.pop(name, None)
            if known is None or known.revision != revision:
                stored = StoredStudy(name, self.results, trust=self.trust)
                known = Revised(revision, stored, {})
            self._seen[name] = known
            while len(self._seen) > MOST_KEPT:
                self._seen.popitem(last=False)
            return known

    def place(self, name: str) -> StudyPlace:
        """Where a study lies. Raises ChoiceError for what is no name of one."""
        if not STUDY_NAME.fullmatch(name):
            raise ChoiceError(why_no_name(name))
        return place_of(self.results / name, self.results)

    def rate(self, name: str, stored: int) -> float | None:
        """Trials a second that were stored since somebody looked for the first time in
        the last LOOKED_BACK seconds; None where none were.
        """
        now = time.monotonic()
        looks = [
            one for one in self._looks.get(name, []) if now - one[0] <= LOOKED_BACK
        ]
        self._looks[name] = [*looks, (now, stored)]
        then, before = self._looks[name][0]
        return (stored - before) / (now - then) if stored > before else None

    def revision(self, name: str) -> str:
        """A word that is another one after anything of the study was stored; of its
        files only names and times are read.
        """
        place = self.place(name)
        parts = [part.name for part in place.parts()]
        said = [_written(place.root / PLAN), *parts]
        return hashlib.sha256("\n".join(said).encode()).hexdigest()[:16]


def _written(file: Location) -> str:
    """When a file was written; "" where there is none."""
    try:
        about = file.stat()
    except FileNotFoundError:
        return ""
    return f"{about.st_size} {about.st_mtime_ns}"
