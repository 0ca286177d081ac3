"""A stored search with `phase` as a parameter that varies.

Trials that chose among candidates, and held-out trials that judge the chosen
candidates, are never averaged together.
"""

from sweep.errors import StoreError
from sweep.methods.search.asked_trials import of_search
from sweep.spec import PLAN
from sweep.store import SEARCH_AGAIN
from sweep.tables import StoredStudy

PHASE = "phase"
MEANINGS = {
    "search": (
        "trials of phase search chose among the candidates, so the best candidates"
        " look too good"
    ),
    "held_out": "trials of phase held_out judge the chosen candidates with other seeds",
}


def by_phase(study: StoredStudy) -> StoredStudy:
    """Return a search with separate phases; return any other study unchanged.

    Raises StoreError if the stored requests of the search lack a column.
    """
    if study.split or (requests := of_search(study.store.read_asked())) is None:
        return study
    if lacking := {"trial_id", PHASE} - set(requests.column_names):
        raise StoreError(
            f"{study.store.folder / PLAN}: column {min(lacking)} is missing;"
            f" {SEARCH_AGAIN}"
        )
    rows = requests.select(["trial_id", PHASE]).to_pandas().drop_duplicates("trial_id")
    return study.divided(PHASE, rows.set_index("trial_id")[PHASE], MEANINGS)
