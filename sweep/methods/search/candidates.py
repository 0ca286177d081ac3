"""From values of the parameters to trials; references; the seeds of a search."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from sweep.design import Job, Jobs, expand
from sweep.errors import SpecError
from sweep.methods.search.section_keys import Parameter, Search
from sweep.spec import DISTRIBUTIONS, Axis, Study, Value, address

SAMPLER, HELD_OUT, REPETITION, RANDOM, PROBE = range(5)
"""Purposes of the random numbers of a search; see `sweep.spec.seeds`."""

PROBES = 100


class Candidate:
    """A set of values of the parameters of a search. Trials are made on demand.

    Raises SpecError if the spec rejects the candidate in any scenario: by `require`, or
    because parameters are not compatible.
    """

    def __init__(self, study: Study, values: Mapping[str, Value]) -> None:
        search = section_of(study)
        self.values = dict(values)
        columns = {
            name: study.settings[name].column([value]) for name, value in values.items()
        }
        extended = replace(study, axes=(*search.over, Axis("candidates", columns)))
        design = expand(extended)
        if design.n_points < search.scenarios:
            rejected = search.scenarios - design.n_points
            raise study.document.error(
                ("require",), f"{rejected} of {search.scenarios} scenarios are rejected"
            )
        self.jobs = Jobs(extended, design)

    def job(self, block: int, scenario: int) -> Job:
        """Return one trial of the candidate.

        Parameters
        ----------
        block : int
            Index of the block.
        scenario : int
            Index of the scenario.
        """
        return self.jobs[scenario * self.jobs.study.trials_per_point + block]

    @property
    def points(self) -> tuple[str, ...]:
        """Ids of the points, one per scenario; the ids identify the candidate."""
        return tuple(self.jobs.points)


def section_of(study: Study) -> Search:
    """Return the search of a study. Raises SpecError for a study without a search."""
    search: Search | None = study.sections.get("search")
    if search is None:
        raise study.document.error(
            (), 'has no "search" section: run the study with "sweep launch"'
        )
    return search


def check_candidates(study: Study) -> None:
    """Raise SpecError if all of PROBES random candidates are impossible.

    `require` is left out, so that the error is about parameters that are not
    compatible.
    """
    free = replace(study, require=())
    failure: SpecError | None = None
    for values in _probes(study):
        try:
            Candidate(free, values)
            return
        except SpecError as error:
            failure = failure or error
    if failure:
        raise failure


def references(study: Study) -> list[Candidate]:
    """Return the references of a search, in the order of its spec.

    Raises SpecError if a reference is not possible.
    """
    return [_reference(study, name) for name in section_of(study).references]


def _reference(study: Study, name: str) -> Candidate:
    try:
        return Candidate(study, section_of(study).references[name])
    except SpecError as error:
        raise study.document.error(
            ("search", "references", name), f'reference "{name}" is impossible: {error}'
        ) from None


def _probes(study: Study) -> Sequence[dict[str, Value]]:
    """Return PROBES random sets of values of the parameters."""
    rng = np.random.default_rng(address(study.seed, "search", PROBE))
    columns = [
        _drawn(study, parameter, rng) for parameter in section_of(study).parameters
    ]
    parameters = [parameter.name for parameter in section_of(study).parameters]
    return [
        dict(zip(parameters, row, strict=True)) for row in zip(*columns, strict=True)
    ]


def _drawn(study: Study, parameter: Parameter, rng: np.random.Generator) -> list[Value]:
    setting = study.settings[parameter.name]
    values = DISTRIBUTIONS[parameter.form].values(
        rng.random(PROBES), setting, parameter.arguments
    )
    drawn: list[Value] = setting.column(values).tolist()
    return drawn


def sampler_seed(study: Study) -> int:
    """Return the seed of the sampler, of 32 bits."""
    return int(address(study.seed, "search", SAMPLER).generate_state(1)[0])


def repeated(study: Study, kind: int, number: int) -> Study:
    """Return the study of a repetition of a search, or of a random search.

    All random numbers of the study differ.

    Parameters
    ----------
    study : Study
        Study of the search.
    kind : int
        REPETITION or RANDOM.
    number : int
        Number of the repetition, from 1.
    """
    return replace(study, seed=_seed(study, kind, number))


def held_out(study: Study) -> Study:
    """Return the study of the held-out trials.

    No search of the study uses the new seed, so that replicates are new to every run.
    """
    taken = {study.seed, *(study.seeds or ())}
    seed = next(
        seed
        for seed in (_seed(study, HELD_OUT, attempt) for attempt in count())
        if seed not in taken
    )
    return replace(
        study, seed=seed, seeds=None, replicates=section_of(study).held_out.replicates
    )


def _seed(study: Study, *key: int) -> int:
    """Return a seed of 63 bits."""
    return int(
        address(study.seed, "search", *key).generate_state(1, np.uint64)[0]
        >> np.uint64(1)
    )
