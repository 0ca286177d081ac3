"""What a search has asked for, as a table beside its trials: `asked.parquet`, which is
derived and can be lost.

One row a block and scenario of a candidate: `run` ("search", "repetition 1", "random 1"
and so on, or "references"), `phase` ("search" or "held_out"; such a row has the run
whose candidate it judges), `candidate` (its number in the order asked in that run, of
references their place), `batch` (-1 where there is none), `block`, `scenario` and
`trial_id`. What the search was is in the metadata.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pandas as pd
import pyarrow as pa

from sweep.campaigns.search.candidates import section_of
from sweep.campaigns.search.samplers import options
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.spec.recorded import columns_of
from sweep.spec.settings import Value
from sweep.spec.study import Study
from sweep.store.origin import metadata
from sweep.store.plan_about import AxisAbout, PlanAbout
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy

ABOUT = b"search"
"""The key, in the metadata of asked.parquet, of what the search was, as JSON."""

SHAPE = {
    "parameters": [str],
    "ranges": {str: {str: list}},
    "objectives": [{}],
    "constraints": [{}],
    "blocks": {str: int},
    "rejected": {str: int},
    "repeated": {str: int},
}
SEARCH_AGAIN = "delete it and search again"

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
class Asked:
    """`table` has the rows of asked.parquet, each with its trial's `status`, parameters
    and metric columns.

    The status is "missing" where the trial is not stored. `about` says what the search
    was: "parameters" and "ranges", "objectives" and "constraints" as their `as_json`
    has them, "references", "budget", "sampler" and "options", "batch", "level",
    "scenarios", "repetitions", whether it is "finished", and by run "blocks" (the most
    that a candidate gets), "rejected" and "repeated" (how many of the proposals were).
    """

    table: pd.DataFrame
    about: dict[str, Any]


def read_asked(study: StoredStudy) -> Asked:
    """What a stored search has asked for. Raises ChoiceError where it is no search."""
    asked = study.store.read_asked()
    if asked is None:
        raise ChoiceError(f"study {study.name}: not a search (it has no asked.parquet)")
    about = metadata(asked.schema, ABOUT, SHAPE, study.store.asked, SEARCH_AGAIN)
    metrics = columns_of(study.metrics)
    stored = study.read("trials", asked["trial_id"].combine_chunks()).to_pandas()
    known = stored.reindex(columns=["trial_id", "status", *metrics])
    planned = study.plan.select(["trial_id", *about["parameters"]]).to_pandas()
    table = (
        asked.to_pandas()
        .merge(planned, on="trial_id", how="left")
        .merge(known, on="trial_id", how="left")
    )
    return Asked(table.assign(status=table["status"].fillna("missing")), about)


@dataclass(eq=False)
class Sheet:
    """The plan and the table of what is asked for, while they grow; `about` is the
    latter's metadata.
    """

    study: Study
    store: Store
    origin: Mapping[str, object]
    about: dict[str, Any]
    planned: list[dict[str, Value]] = field(default_factory=list)
    rows: list[tuple[str, str, int, int, int, int, str]] = field(default_factory=list)
    ids: set[str] = field(default_factory=set)

    def add(
        self,
        run: str,
        phase: str,
        candidate: int,
        batch: int,
        trials: Sequence[Sequence[Job]],
    ) -> None:
        """Note the trials of a candidate by block and scenario."""
        for block, jobs in enumerate(trials):
            for scenario, job in enumerate(jobs):
                self.rows.append(
                    (run, phase, candidate, batch, block, scenario, job.trial_id)
                )
                if job.trial_id not in self.ids:
                    self.ids.add(job.trial_id)
                    self.planned.append(_planned(job, self.varied))

    @property
    def varied(self) -> list[str]:
        """The settings that can differ between trials: parameters, scenarios, and what
        follows from them.
        """
        search = section_of(self.study)
        names = [setting for axis in search.over for setting in axis.columns]
        names += [parameter.name for parameter in search.parameters]
        if "map" in names:
            names += [
                side
                for side in ("width", "height")
                if self.study.place_of(side) is None
            ]
        for name, expression in self.study.derive.items():
            names += [name] if expression.names & set(names) else []
        return names

    def write(self) -> None:
        """Replace what is stored of both."""
        columns = zip(*self.rows, strict=True) if self.rows else [[] for _ in COLUMNS]
        asked = pa.table(
            [pa.array(column) for column in columns],
            COLUMNS.with_metadata({ABOUT: json.dumps(self.about)}),
        )
        self.store.write_plan(self._plan(), asked)
        self.store.write_spec(self.study.text)

    def _plan(self) -> pa.Table:
        search = section_of(self.study)
        parameters = [parameter.name for parameter in search.parameters]
        candidates = {"candidates": AxisAbout(parameters, search.sampler)}
        about = PlanAbout.of(self.study, self.varied, search.over)
        about = replace(about, axes=(about.axes or {}) | candidates)
        return about.into(pa.Table.from_pylist(self.planned), self.origin)


def about_search(
    study: Study, blocks: Mapping[str, int], repetitions: int
) -> dict[str, Any]:
    """The metadata of a new search; `blocks` are the most of a candidate, by run."""
    search = section_of(study)
    return {
        "parameters": [parameter.name for parameter in search.parameters],
        "ranges": {
            one.name: {one.form: list(one.arguments)} for one in search.parameters
        },
        "objectives": [objective.as_json() for objective in search.objectives],
        "constraints": [constraint.as_json() for constraint in search.constraints],
        "references": list(search.references),
        "budget": search.budget,
        "sampler": search.sampler,
        "options": options(search.sampler, search),
        "batch": search.batch,
        "level": search.level,
        "scenarios": search.scenarios,
        "blocks": dict(blocks),
        "rejected": dict.fromkeys(blocks, 0),
        "repeated": dict.fromkeys(blocks, 0),
        "finished": False,
        "repetitions": repetitions,
    }


def _planned(job: Job, varied: Sequence[str]) -> dict[str, Value]:
    about: dict[str, Value] = {
        "trial_id": job.trial_id,
        "point": job.point,
        "replicate": job.replicate,
        "seed": job.seed,
    }
    return about | {name: job.settings[name] for name in varied}
