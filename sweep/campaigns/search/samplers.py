"""Who proposes candidates: optuna's samplers, with every option that counts said here,
whatever optuna's defaults.

To add one, write a function and enter it in SAMPLERS, and its name in
`sweep.spec.search`.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from sweep.spec.search import Parameter, Search
from sweep.spec.settings import Value

if TYPE_CHECKING:
    from optuna import Study as OptunaStudy
    from optuna.distributions import BaseDistribution
    from optuna.samplers import BaseSampler

Options = dict[str, Any]
"""The options of one of optuna's samplers by name, plain values."""


def random(_search: Search) -> Options:
    """Independent draws."""
    return {}


def qmc(_search: Search) -> Options:
    """The scrambled Sobol sequence."""
    return {
        "qmc_type": "sobol",
        "scramble": True,
        "warn_asynchronous_seeding": False,
        "warn_independent_sampling": False,
    }


def tpe(search: Search) -> Options:
    """The tree-structured Parzen estimator, which takes candidates without a result yet
    for bad ones.

    Its densities are joint ones for one objective; for several optuna's authors advise
    one for each parameter.
    """
    return {
        "n_startup_trials": 10,
        "n_ei_candidates": 24,
        "multivariate": len(search.objectives) == 1,
        "group": False,
        "constant_liar": True,
    }


def cmaes(search: Search) -> Options:
    """CMA-ES from the middle of the ranges by batches, of which the first is random."""
    return {
        "x0": None,
        "sigma0": None,
        "n_startup_trials": 1,
        "warn_independent_sampling": False,
        "consider_pruned_trials": False,
        "popsize": max(search.batch, 2),
        "use_separable_cma": False,
        "with_margin": False,
        "lr_adapt": False,
        "source_trials": None,
    }


def gp(_search: Search) -> Options:
    """A Gaussian process with noise, and logarithmic expected improvement."""
    return {
        "n_startup_trials": 10,
        "deterministic_objective": False,
        "warn_independent_sampling": False,
    }


def nsga2(search: Search) -> Options:
    """NSGA-II, a batch being its population."""
    return {
        "population_size": search.batch,
        "mutation": None,
        "mutation_prob": None,
        "crossover": None,
        "crossover_prob": 0.9,
        "swapping_prob": 0.5,
    }


def nsga3(search: Search) -> Options:
    """NSGA-III, a batch being its population, with reference points on four levels of
    each objective.
    """
    return nsga2(search) | {"reference_points": None, "dividing_parameter": 3}


SAMPLERS: dict[str, tuple[str, Callable[[Search], Options]]] = {
    "random": ("RandomSampler", random),
    "qmc": ("QMCSampler", qmc),
    "tpe": ("TPESampler", tpe),
    "cmaes": ("CmaEsSampler", cmaes),
    "gp": ("GPSampler", gp),
    "nsga2": ("NSGAIISampler", nsga2),
    "nsga3": ("NSGAIIISampler", nsga3),
}
"""For each sampler optuna's name of it and its options, which lack the seed only."""


def options(name: str, search: Search) -> Options:
    """The options of a sampler, for the record."""
    return SAMPLERS[name][1](search)


def new_study(name: str, search: Search, seed: int) -> "OptunaStudy":
    """An optuna study in memory for these objectives, with the sampler `name` and its
    `seed` of 32 bits.
    """
    with quiet():
        import optuna

        kinds = optuna.study.StudyDirection
        directions = [
            kinds.MAXIMIZE if objective.maximize else kinds.MINIMIZE
            for objective in search.objectives
        ]
        sampler: BaseSampler = getattr(optuna.samplers, SAMPLERS[name][0])(
            seed=seed, **options(name, search)
        )
        return optuna.create_study(directions=directions, sampler=sampler)


def distributions(parameters: tuple[Parameter, ...]) -> "dict[str, BaseDistribution]":
    """What optuna is to ask for each parameter."""
    return {
        parameter.name: _distribution(parameter.form, parameter.arguments)
        for parameter in parameters
    }


def _distribution(form: str, arguments: tuple[Any, ...]) -> "BaseDistribution":
    from optuna.distributions import (
        CategoricalDistribution,
        FloatDistribution,
        IntDistribution,
    )

    if form == "choice":
        return CategoricalDistribution(arguments)
    if form == "integers":
        return IntDistribution(int(arguments[0]), int(arguments[1]))
    return FloatDistribution(arguments[0], arguments[1], log=form == "loguniform")


def size_of(parameters: tuple[Parameter, ...]) -> float:
    """How many candidates there are: infinite where a parameter is continuous."""
    size = 1.0
    for parameter in parameters:
        size *= _count(parameter.form, parameter.arguments)
    return size


def _count(form: str, arguments: tuple[Value, ...]) -> float:
    if form == "choice":
        return len(arguments)
    first, last = float(arguments[0]), float(arguments[1])
    if form == "integers":
        return last - first + 1
    return float("inf") if first < last else 1


@contextmanager
def quiet() -> Iterator[None]:
    """Optuna without its log lines and its remarks on options that are experimental; it
    is imported within.
    """
    with warnings.catch_warnings():
        # In Jupyter tqdm, which optuna imports, asks for widgets for bars that nobody
        # sees.
        warnings.filterwarnings("ignore", "IProgress not found")
        import optuna

    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            yield
    finally:
        optuna.logging.set_verbosity(level)
