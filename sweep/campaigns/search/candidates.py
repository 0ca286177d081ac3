"""From values of the parameters to trials; references; the seeds of a search."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count

import numpy as np

from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.errors import SpecError
from sweep.spec.axes import Axis
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.search import Parameter, Search
from sweep.spec.seeds import address
from sweep.spec.settings import Value
from sweep.spec.study import Study

SAMPLER, HELD_OUT, REPETITION, RANDOM, PROBE = range(5)
"""What the random numbers of a search are for; see `sweep.spec.seeds`."""

PROBES = 100


class Candidate:
    """One set of values of the parameters of a search. Trials are made when asked for.

    Raises SpecError where the spec rejects it in any scenario: by `require`, or because
    settings do not go together.
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
        """One of its trials."""
        return self.jobs[scenario * self.jobs.study.trials_per_point + block]

    @property
    def points(self) -> tuple[str, ...]:
        """The ids of its points, one a scenario; they tell candidates apart."""
        return tuple(self.jobs.points)


def section_of(study: Study) -> Search:
    """The search of a study. Raises SpecError where it has none."""
    if study.search is None:
        raise study.document.error(
            (), 'has no "search" section: run it with "sweep launch"'
        )
    return study.search


def check_candidates(study: Study) -> None:
    """Raise SpecError where none of PROBES random candidates is allowed, even without
    `require`: some settings do not go together.
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
    """The references of a study's search, in the order of its spec. Raises SpecError
    where one cannot be.
    """
    return [_reference(study, name) for name in section_of(study).references]


def _reference(study: Study, name: str) -> Candidate:
    try:
        return Candidate(study, section_of(study).references[name])
    except SpecError as error:
        raise study.document.error(
            ("search", "references", name), f'reference "{name}" cannot be: {error}'
        ) from None


def _probes(study: Study) -> Sequence[dict[str, Value]]:
    """PROBES random sets of values of the parameters."""
    rng = np.random.default_rng(address(study.seed, "search", PROBE))
    columns = [
        _drawn(study, parameter, rng) for parameter in section_of(study).parameters
    ]
    names = [parameter.name for parameter in section_of(study).parameters]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def _drawn(study: Study, parameter: Parameter, rng: np.random.Generator) -> list[Value]:
    setting = study.settings[parameter.name]
    values = DISTRIBUTIONS[parameter.form].values(
        rng.random(PROBES), setting, parameter.arguments
    )
    drawn: list[Value] = setting.column(values).tolist()
    return drawn


def sampler_seed(study: Study) -> int:
    """The seed of the sampler, of 32 bits."""
    return int(address(study.seed, "search", SAMPLER).generate_state(1)[0])


def repeated(study: Study, kind: int, number: int) -> Study:
    """The study with other random numbers throughout: a repetition of its search, or a
    random search.
    """
    return replace(study, seed=_seed(study, kind, number))


def held_out(study: Study) -> Study:
    """The study of the held-out trials. It has a seed that no search of the study uses,
    so that its replicates are new to every run.
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
    """A seed of 63 bits."""
    return int(
        address(study.seed, "search", *key).generate_state(1, np.uint64)[0]
        >> np.uint64(1)
    )
