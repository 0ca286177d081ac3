"""The table of the candidates of a search, which is stored with the plan.

If the table is lost, a repetition of the search writes the table again. The table has a
row per block and scenario of a candidate:

    run        "search", "repetition 1", "random 1" and so on, or "references"
    phase      "search" or "held_out"; a held-out row has the run that it judges

    candidate  number in the order asked in the run; the index of a reference
    batch      -1 without batches
    block
    scenario
    trial_id

The metadata describe the search.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd
import pyarrow as pa

from sweep.analysis import Declared
from sweep.errors import ChoiceError, StoreError, UserError
from sweep.methods.search.objectives import Objective
from sweep.methods.search.statistics import STATISTICS
from sweep.spec import (
    DISTRIBUTIONS,
    PLAN,
    Study,
    columns_of,
    parse_document,
    sections,
)
from sweep.store import SEARCH_AGAIN, Location, Store, metadata, plan_provenance
from sweep.tables import StoredStudy

ABOUT = b"search"
"""Key of the description of the search in the metadata of the table, as JSON."""

SHAPE = {
    "parameters": [str],
    "ranges": {str: {str: list}},
    "objectives": [{"statistic": str}],
    "constraints": [{"statistic": str}],
    "blocks": {str: int},
    "rejected": {str: int},
    "repeated": {str: int},
}

COLUMNS = pa.schema(
    [
        ("run", pa.string()),
        ("phase", pa.string()),
        ("candidate", pa.int64()),
        ("batch", pa.int64()),
        ("block", pa.int64()),
        ("scenario", pa.int64()),
        ("trial_id", pa.string()),
    ]
)


@dataclass(frozen=True, eq=False)
class AskedTrials:
    """The table of a search with its trials, and the description of the search.

    Attributes
    ----------
    table : DataFrame
        The rows, each with the status, parameters and metric columns of its trial. The
        status is "missing" if the trial is not stored.
    description : dict
        "parameters" and "ranges", "objectives" and "constraints" as returned by
        `as_json`, "references", "budget", "sampler" and "options", "batch", "level",
        "scenarios", "repetitions", and "finished". By run: "blocks" (the largest number
        of a candidate), "rejected" and "repeated" (numbers of proposals).
    distributions : mapping
        Distribution of the values of each column.
    """

    table: pd.DataFrame
    description: dict[str, Any]
    distributions: Mapping[str, Declared]


def of_search(requests: pa.Table | None) -> pa.Table | None:
    """Return the table of a search; None without a table, and for another section.

    A table that the strategy of another section has written has the key of the section
    in its metadata.

    Parameters
    ----------
    requests : Table or None
        Stored requests of a study.
    """
    if requests is None:
        return None
    keys = {key.decode(errors="replace") for key in requests.schema.metadata or {}}
    return None if keys & (sections().keys() - {ABOUT.decode()}) else requests


def stored_repetitions(study: Study, results: Location) -> int:
    """Return the number of repetitions of a stored search with an identical spec.

    So a repeated command resumes the search. The number is 0 if a different spec, or
    nothing readable, is stored. Comments do not change a spec.
    """
    store = Store(results / study.name, results)
    try:
        search_table = store.read_asked()
        plan = store.read_plan()
        if search_table is None:
            return 0
        description = _description(store, search_table)
        spec = plan_provenance(plan, store.folder / PLAN)["spec"]
        stored = parse_document(spec, study.path).value
    except UserError:  # the launch reports the cause, or writes the table again
        return 0
    current = parse_document(study.text, study.path).value
    repetitions = description.get("repetitions")
    return (
        repetitions
        if stored == current and type(repetitions) is int and repetitions > 0
        else 0
    )


def read_asked(study: StoredStudy) -> AskedTrials:
    """Return the table of a stored search, with its trials.

    Raises ChoiceError if the study is not a search, or if `where` has restricted the
    study. Raises StoreError for a statistic or a distribution that is not known here.
    """
    search_table = of_search(study.store.read_asked())
    if search_table is None:
        raise ChoiceError("not a search", study.name)
    if study.restricted:
        raise ChoiceError("a search cannot be restricted by where", study.name)
    description = _description(study.store, search_table)
    _check_known(study.store.folder / PLAN, description)
    metrics = columns_of(study.metrics)
    stored = study.read("trials", search_table["trial_id"].combine_chunks()).to_pandas()
    values = stored.reindex(columns=["trial_id", "status", *metrics])
    planned = study.plan.select(["trial_id", *description["parameters"]]).to_pandas()
    table = (
        search_table.to_pandas()
        .merge(planned, on="trial_id", how="left")
        .merge(values, on="trial_id", how="left")
    )
    return AskedTrials(
        table.assign(status=table["status"].fillna("missing")),
        description,
        study.distributions,
    )


def asked_objectives(study: StoredStudy) -> list[Objective]:
    """Return the objectives of a stored search, in the order of its spec.

    The list is empty if the study is not a search. Raises StoreError for a statistic
    that is not known here.
    """
    requests = of_search(study.asked)
    if requests is None:
        return []
    description = _description(study.store, requests)
    _check_known(study.store.folder / PLAN, description)
    return [Objective.from_json(objective) for objective in description["objectives"]]


def _description(store: Store, search_table: pa.Table) -> dict[str, Any]:
    """Return the description of a search from the metadata of its table.

    Raises StoreError if the description is missing or invalid.
    """
    return metadata(
        search_table.schema, ABOUT, SHAPE, store.folder / PLAN, remedy=SEARCH_AGAIN
    )


def _check_known(file: Location, description: Mapping[str, Any]) -> None:
    """Raise StoreError if a search uses an unknown statistic or distribution.

    The table may come from an untrusted source.
    """
    sections = (*description["objectives"], *description["constraints"])
    statistics = {section["statistic"] for section in sections} - STATISTICS.keys()
    forms = {form for spread in description["ranges"].values() for form in spread}
    for kind, names in (
        ("statistic", statistics),
        ("distribution", forms - DISTRIBUTIONS.keys()),
    ):
        if names:
            raise StoreError(
                f'{file}: there is no {kind} "{min(names)}" here; register it, or'
                f" {SEARCH_AGAIN}"
            )
