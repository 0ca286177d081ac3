"""A stored search with `phase` as a parameter that varies.

Trials that chose among candidates, and held-out trials that judge the chosen ones, are
never averaged together.
"""

from functools import cached_property

import pandas as pd
import pyarrow as pa

from sweep.errors import StoreError
from sweep.spec.study_folder import PLAN
from sweep.store.plan_about import AxisAbout
from sweep.store.store import SEARCH_AGAIN
from sweep.tables.stored_study import StoredStudy

PHASE = "phase"
MEANINGS = {
    "search": (
        "trials of phase search chose among the candidates, so the best of them look"
        " too good"
    ),
    "held_out": "trials of phase held_out judge the chosen ones with other seeds",
}


class PhasedSearch(StoredStudy):
    """The trials of a search, each in one of its `phases`, by trial_id.

    A candidate with trials in several phases is a point in each of them.
    """

    def __init__(self, study: StoredStudy, phases: "pd.Series[str]") -> None:
        self._study = study
        self.name = study.name
        self.trust = study.trust
        self.store = study.store
        self.provenance = study.provenance
        self.chosen = study.chosen
        self.conditions = study.conditions
        if study.restricted:
            self.whole = PhasedSearch(study.whole, phases)
        planned = study.plan.select(["trial_id", "point"]).to_pandas()
        phase = planned["trial_id"].map(phases).fillna("").astype(str)
        self._point = (phase + ":" + planned["point"]).set_axis(planned["trial_id"])
        self._phase = dict(zip(self._point, phase, strict=True))
        self._candidate: dict[str, str] = dict(
            zip(self._point, planned["point"], strict=True)
        )
        place = study.plan.column_names.index("point")
        points = pa.array(self._point, pa.string())
        self.plan = study.plan.set_column(place, "point", points)

    @property
    def kept_apart(self) -> list[str]:
        """The phase, over which nothing is averaged."""
        return [PHASE]

    @property
    def apart_notes(self) -> list[str]:
        """Sentences about the phases that the study has."""
        phases = set(self.points[PHASE])
        return [text for name, text in MEANINGS.items() if name in phases]

    def candidate(self, point: str) -> str:
        """Return the id of the candidate that a point is in one phase."""
        return self._candidate[point]

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row per point, by its phase and its id, `phase:point`."""
        points = super().points
        points.insert(0, PHASE, [self._phase[point] for point in points.index])
        return points

    @cached_property
    def trials(self) -> pd.DataFrame:
        """The stored trials, with their phase."""
        trials = self._study.trials
        points = self._point[trials["trial_id"]].to_numpy(object)
        phases = [self._phase[point] for point in points]
        return trials.assign(point=points, phase=phases)

    @property
    def varied(self) -> list[str]:
        """The phase, if there are several, and the parameters that differ."""
        several = self.points[PHASE].nunique() > 1
        return [*([PHASE] if several else []), *super().varied]

    @property
    def axes(self) -> dict[str, AxisAbout]:
        """The axes, with the phase as an axis that lists its values."""
        return {PHASE: AxisAbout([PHASE], None), **super().axes}


def by_phase(study: StoredStudy) -> StoredStudy:
    """Return a search with separate phases; return any other study unchanged.

    Raises StoreError if the stored requests of the search lack a column.
    """
    if study.kept_apart or (requests := study.store.read_asked()) is None:
        return study
    if lacking := {"trial_id", PHASE} - set(requests.column_names):
        raise StoreError(
            f"{study.store.folder / PLAN}: it has no column {min(lacking)};"
            f" {SEARCH_AGAIN}"
        )
    rows = requests.select(["trial_id", PHASE]).to_pandas().drop_duplicates("trial_id")
    return PhasedSearch(study, rows.set_index("trial_id")[PHASE])
