"""The largest number of trials that a search would run, before any trial runs."""

import json
from dataclasses import asdict, dataclass, replace

from sweep.design import (
    about,
    compiled,
    expand,
    notes_of,
    probed,
    size,
    study_cost,
)
from sweep.methods.search.candidates import check_candidates, references, section_of
from sweep.spec import Study
from sweep.text import so_many
from sweep.trial import measured_pace


@dataclass(frozen=True)
class SearchPlan:
    """Counts and estimates for a search that spends its budget, without repetitions.

    `probe_steps`, `notes` and `compiling_seconds` are as in a Plan.
    """

    study: str
    model: str
    code: tuple[str, ...]
    preset: str
    parameters: list[str]
    sampler: str
    batch: int
    blocks: int
    scenarios: int
    budget: int
    held_out_trials: int
    trials: int
    cpu_seconds: float
    wall_seconds: float
    workers: int
    result_bytes: float
    on_error: str
    probe_steps: int
    notes: tuple[str, ...]
    compiling_seconds: float = 0.0

    def as_json(self) -> str:
        """Return the plan as a JSON object."""
        return json.dumps(asdict(self), indent=2)

    def as_text(self) -> str:
        """Return the plan for a reader."""
        scenarios = (
            f" in each of {self.scenarios:,} scenarios" if self.scenarios > 1 else ""
        )
        lines = [
            f"study      {self.study}",
            f"model      {self.model}, preset {self.preset}",
            *([f"runs code  {', '.join(self.code)}"] if self.code else []),
            f"search     {self.sampler} over {', '.join(self.parameters)}",
            (
                f"candidates in batches of {self.batch:,}, each with at most"
                f" {self.blocks:,} trials{scenarios}"
            ),
            (
                f"trials     at most {self.trials:,},"
                f" of which {self.held_out_trials:,} on held-out seeds"
            ),
            *([f"on error   {self.on_error}"] if self.on_error else []),
            (
                f"CPU time   {about(self.cpu_seconds, 'at most ')}"
                f"{probed(self.probe_steps)}"
            ),
            (
                f"wall time  {about(self.wall_seconds, 'at most ')} with"
                f" {so_many(self.workers, 'worker')}"
                f"{compiled(self.compiling_seconds)}"
            ),
            f"results    at most about {size(self.result_bytes)}",
        ]
        return "\n".join(lines + [f"note       {note}" for note in self.notes])


def make_search_plan(
    study: Study, workers: int, compiling_seconds: float = 0.0
) -> SearchPlan:
    """Return the plan of a search, with times for the values of the preset.

    Parameters
    ----------
    study : Study
    workers : int
        Number of workers, for the wall time.
    compiling_seconds : float, default 0
        Additional wall time, once.

    Raises
    ------
    SpecError
        If no candidate is allowed, if a reference is not possible, and as
        `measured_pace`.
    """
    search = section_of(study)
    check_candidates(study)
    references(study)
    # With the section, so that notes and the probe know which parameters are searched.
    scenarios = replace(study, axes=search.over, require=(), replicates=1, seeds=None)
    pace = measured_pace(scenarios)
    design = expand(scenarios)
    cost = study_cost(scenarios, design, pace)
    parameters = [parameter.name for parameter in search.parameters]
    held_out = search.held_out_trials(0)
    trials = search.budget + held_out
    share = trials / search.scenarios
    return SearchPlan(
        study=study.name,
        model=study.model,
        code=study.catalogue.runs,
        preset=study.preset,
        parameters=parameters,
        sampler=search.sampler,
        batch=search.batch,
        blocks=study.trials_per_point,
        scenarios=search.scenarios,
        budget=search.budget,
        held_out_trials=held_out,
        trials=trials,
        cpu_seconds=cost.seconds * share,
        wall_seconds=cost.seconds * share / workers,
        workers=workers,
        result_bytes=cost.size_bytes * share,
        on_error=study.policy.in_words(trials),
        probe_steps=pace.steps,
        notes=tuple(notes_of(scenarios, design, parameters)),
        compiling_seconds=compiling_seconds,
    )
