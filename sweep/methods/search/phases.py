"""The candidates that a search has requested so far, by phase, and their tables."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd
import pyarrow as pa

from sweep.campaigns import Origin, PlanTables
from sweep.design import Job
from sweep.methods.search.asked_trials import ABOUT, COLUMNS, AskedTrials
from sweep.methods.search.candidates import section_of
from sweep.methods.search.known_samplers import SEARCH_SAMPLERS
from sweep.methods.search.known_values import KnownValues
from sweep.methods.search.run import AskedCandidate
from sweep.spec import Study, Value
from sweep.store import AxisAbout, PlanAbout


class AskedRow(NamedTuple):
    """A row of the table of a search, with a job in place of its id."""

    run: str
    phase: str
    candidate: int
    batch: int
    block: int
    scenario: int
    job: Job


class AskedPhase(NamedTuple):
    """The candidates of a phase of a run, in the order asked.

    The list of candidates may grow, and the trials of each candidate too.
    """

    run: str
    phase: str
    candidates: list[AskedCandidate]

    def rows(self) -> Iterator[AskedRow]:
        """Yield one row per trial, by candidate, block and scenario."""
        for candidate in self.candidates:
            for block, jobs in enumerate(candidate.trials):
                for scenario, job in enumerate(jobs):
                    shared = self.run, self.phase, candidate.number, candidate.batch
                    yield AskedRow(*shared, block, scenario, job)


def plan_tables(
    study: Study,
    phases: Sequence[AskedPhase],
    description: Mapping[str, Any],
    origin: Origin,
) -> PlanTables:
    """Return the plan of a search, and the table of the search.

    The plan lists each trial once.

    Parameters
    ----------
    study : Study
        Study of the search.
    phases : sequence of AskedPhase
        Phases so far.
    description : mapping
        Description of the search, for the metadata of its table.
    origin : Origin
        Provenance, for the metadata of the plan.
    """
    rows = [row for phase in phases for row in phase.rows()]
    jobs = {row.job.trial_id: row.job for row in rows}
    columns = {
        name: [getattr(row, name) for row in rows] for name in COLUMNS.names[:-1]
    }
    columns["trial_id"] = [row.job.trial_id for row in rows]
    search_table = pa.table(
        columns, COLUMNS.with_metadata({ABOUT: json.dumps(description)})
    )
    return _plan(study, jobs.values(), origin).to_reader(), search_table


def known_trials(
    study: Study,
    phase: AskedPhase,
    known_values: KnownValues,
    description: dict[str, Any],
) -> AskedTrials:
    """Return the result of `read_asked` for a phase with all trials stored.

    Parameters
    ----------
    study : Study
        Study of the search.
    phase : AskedPhase
        The phase.
    known_values : KnownValues
        Values of the trials of the phase.
    description : dict
        Description of the search.
    """
    distributions = {name: study.distribution(name) for name in known_values.columns}
    parameters = description["parameters"]
    rows = []
    for *where, job in phase.rows():
        values = known_values.trials[job.trial_id]
        settings = [job.settings[name] for name in parameters]
        status = "failed" if values is None else "done"
        cells = values or [None] * len(known_values.columns)
        rows.append([*where, job.trial_id, *settings, status, *cells])
    columns = [*COLUMNS.names, *parameters, "status", *known_values.columns]
    return AskedTrials(pd.DataFrame(rows, columns=columns), description, distributions)


def _plan(study: Study, jobs: Iterable[Job], origin: Origin) -> pa.Table:
    search = section_of(study)
    varied = _varied(study)
    parameters = [parameter.name for parameter in search.parameters]
    candidates = {"candidates": AxisAbout(parameters, search.sampler)}
    metadata = PlanAbout.of(study, varied, search.over)
    metadata = replace(metadata, axes=(metadata.axes or {}) | candidates)
    rows = [_planned(job, varied) for job in jobs]
    return metadata.into(pa.Table.from_pylist(rows), origin)


def _varied(study: Study) -> list[str]:
    """Return the parameters that can differ between trials.

    The result has the parameters of the search, the parameters of scenarios, and
    parameters derived from either.
    """
    search = section_of(study)
    names = [setting for axis in search.over for setting in axis.columns]
    names += [parameter.name for parameter in search.parameters]
    if "map" in names:
        names += [side for side in ("width", "height") if study.place_of(side) is None]
    for name, expression in study.derive.items():
        names += [name] if expression.names & set(names) else []
    return names


def about_search(
    study: Study, blocks: Mapping[str, int], repetitions: int
) -> dict[str, Any]:
    """Return the description of a new search.

    Parameters
    ----------
    study : Study
        Study of the search.
    blocks : mapping of int
        Largest number of blocks of a candidate, by run.
    repetitions : int
        Number of repetitions.
    """
    search = section_of(study)
    return {
        "parameters": [parameter.name for parameter in search.parameters],
        "ranges": {
            parameter.name: {parameter.form: list(parameter.arguments)}
            for parameter in search.parameters
        },
        "objectives": [objective.as_json() for objective in search.objectives],
        "constraints": [constraint.as_json() for constraint in search.constraints],
        "references": list(search.references),
        "budget": search.budget,
        "sampler": search.sampler,
        "options": SEARCH_SAMPLERS[search.sampler].options(search),
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
    row: dict[str, Value] = {
        "trial_id": job.trial_id,
        "point": job.point,
        "replicate": job.replicate,
        "seed": job.seed,
    }
    return row | {name: job.settings[name] for name in varied}
