"""Optuna as the sampler of a search: its study, and the ranges of parameters."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from sweep.methods.search.known_samplers import SEARCH_SAMPLERS
from sweep.methods.search.section_keys import Parameter, Search
from sweep.spec import DISTRIBUTIONS, Value

if TYPE_CHECKING:
    from optuna import Study as OptunaStudy
    from optuna.distributions import BaseDistribution


def new_study(name: str, search: Search, seed: int) -> "OptunaStudy":
    """Return an optuna study in memory, for the objectives of a search.

    Parameters
    ----------
    name : str
        Name of the sampler.
    search : Search
        The search, with objectives and options.
    seed : int
        Seed of the sampler, of 32 bits.
    """
    with quiet():
        import optuna

        kinds = optuna.study.StudyDirection
        directions = [
            kinds.MAXIMIZE if objective.maximize else kinds.MINIMIZE
            for objective in search.objectives
        ]
        entry = SEARCH_SAMPLERS[name]
        sampler = entry.make(seed=seed, **entry.options(search))
        return optuna.create_study(directions=directions, sampler=sampler)


def distributions(parameters: tuple[Parameter, ...]) -> "dict[str, BaseDistribution]":
    """Return the distribution of optuna for each parameter."""
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

    entry = DISTRIBUTIONS[form]
    if entry.kind == "listed":
        return CategoricalDistribution(arguments)
    if entry.kind == "whole":
        return IntDistribution(int(arguments[0]), int(arguments[1]))
    return FloatDistribution(arguments[0], arguments[1], log=entry.logarithmic)


def size_of(parameters: tuple[Parameter, ...]) -> float:
    """Return the number of candidates: infinite if a parameter is continuous."""
    size = 1.0
    for parameter in parameters:
        size *= _count(parameter.form, parameter.arguments)
    return size


def _count(form: str, arguments: tuple[Value, ...]) -> float:
    kind = DISTRIBUTIONS[form].kind
    if kind == "listed":
        return len(arguments)
    first = float(arguments[0])
    last = float(arguments[1])
    if kind == "whole":
        return last - first + 1
    return float("inf") if first < last else 1


@contextmanager
def quiet() -> Iterator[None]:
    """Silence the log lines of optuna and warnings about experimental options.

    The context imports optuna.
    """
    with warnings.catch_warnings():
        # In Jupyter tqdm, which optuna imports, asks for widgets for invisible bars.
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
