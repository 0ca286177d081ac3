"""Stored studies in their present state.

Each study is read once, and again after new trials were stored.
"""

import hashlib
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.spec import PLAN, STUDY_NAME, Column, why_no_name
from sweep.store import Location, StudyPlace, place_of
from sweep.tables import StoredStudy, keep_apart

MOST_KEPT = 4
"""Number of studies in memory: the most recently used studies."""
LOOKED_BACK = 60.0
"""Time in seconds over which a rate is measured."""


class Revised(NamedTuple):
    """A study at a revision.

    `narrow` has the studies with some metrics only, by the names of the metrics.
    """

    revision: str
    study: StoredStudy
    narrow: dict[tuple[str, ...], StoredStudy]


class Watched:
    """The studies in a folder or an object store; safe for several threads."""

    def __init__(self, results: Location, *, trust: bool = False) -> None:
        self.results = results
        self.trust = trust
        self._revised: OrderedDict[str, Revised] = OrderedDict()
        self._lock = threading.Lock()
        self._looks: dict[str, list[tuple[float, int]]] = {}

    def narrow(self, name: str, metrics: Sequence[str] = ()) -> StoredStudy:
        """Return a study with the columns that points need, and some metrics.

        The phases of a search are separate. The exceptions of StoredStudy are raised.

        Parameters
        ----------
        name : str
            Name of the study.
        metrics : sequence of str, optional
            Names of metrics or columns; by default all metrics that are recorded.
        """
        return self.at(name, metrics)[1]

    def at(self, name: str, metrics: Sequence[str] = ()) -> tuple[str, StoredStudy]:
        """Return the revision of a study, and the result of `narrow`.

        Parameters
        ----------
        name : str
            Name of the study.
        metrics : sequence of str, optional
            Names of metrics or columns; by default all metrics that are recorded.
        """
        plain = [Column.read(text.rstrip("+-")).metric for text in metrics]
        return self._narrow(name, lambda study: plain or study.metrics)

    def _narrow(
        self, name: str, metrics: Callable[[StoredStudy], Sequence[str]]
    ) -> tuple[str, StoredStudy]:
        revised = self._study(name)
        names = tuple(dict.fromkeys(metrics(revised.study)))
        with self._lock:
            if names not in revised.narrow:
                revised.narrow[names] = keep_apart(revised.study.narrow(names))
            return revised.revision, revised.narrow[names]

    def counted(self, name: str) -> tuple[str, StoredStudy]:
        """Return the revision of a study, and the study without metrics.

        The trials have ids, points and statuses. The exceptions of StoredStudy are
        raised.
        """
        return self._narrow(name, lambda _: ())

    def whole(self, name: str) -> StoredStudy:
        """Return a study with all stored columns of trials.

        The phases of a search are separate. The exceptions of StoredStudy are raised.
        """
        revised = self._study(name)
        with self._lock:
            return keep_apart(revised.study)

    def _study(self, name: str) -> Revised:
        with self._lock:
            revision = self.revision(name)
            revised = self._revised.pop(name, None)
            if revised is None or revised.revision != revision:
                stored = StoredStudy(name, self.results, trust=self.trust)
                revised = Revised(revision, stored, {})
            self._revised[name] = revised
            while len(self._revised) > MOST_KEPT:
                self._revised.popitem(last=False)
            return revised

    def place(self, name: str) -> StudyPlace:
        """Return the location of a study.

        Raises ChoiceError if the name is not a valid name of a study.
        """
        if not STUDY_NAME.fullmatch(name):
            raise ChoiceError(why_no_name(name))
        return place_of(self.results / name, self.results)

    def rate(self, name: str, stored: int) -> float | None:
        """Return the number of trials that were stored per second.

        Parameters
        ----------
        name : str
            Name of the study.
        stored : int
            Number of trials that are stored now.

        Returns
        -------
        float or None
            The rate since the first call of the last LOOKED_BACK seconds; None if no
            trial was stored since then.
        """
        now = time.monotonic()
        looks = [
            look for look in self._looks.get(name, []) if now - look[0] <= LOOKED_BACK
        ]
        self._looks[name] = [*looks, (now, stored)]
        then, before = self._looks[name][0]
        return (stored - before) / (now - then) if stored > before else None

    def revision(self, name: str) -> str:
        """Return a text that changes whenever new trials of the study are stored.

        The text depends only on names, times and sizes of files, not on the content.
        """
        place = self.place(name)
        parts = [part.name for part in place.parts()]
        lines = [_written(place.root / PLAN), *parts]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def _written(file: Location) -> str:
    """Return the size and time of a file; "" for a missing file."""
    try:
        status = file.stat()
    except FileNotFoundError:
        return ""
    return f"{status.st_size} {status.st_mtime_ns}"
