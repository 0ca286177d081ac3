"""Samplers of a search, which propose candidates.

The samplers are optuna's. Every option that matters is set here, whatever optuna's
default. To add a sampler, write a function that returns the options and enter the
sampler in SEARCH_SAMPLERS.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from sweep.methods.search.objectives import Constraint, Objective
from sweep.spec import DISTRIBUTIONS
from sweep.text import installing

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler

Options = dict[str, Any]
"""Options of a sampler of optuna by name, plain values."""


class Sought(Protocol):
    """The part of `section_keys.Search` that a sampler may read."""

    @property
    def parameters(self) -> tuple[Any, ...]:
        """The parameters of the search, each a `section_keys.Parameter`."""

    @property
    def objectives(self) -> tuple[Objective, ...]:
        """The objectives of the search."""

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """The constraints of the search."""

    @property
    def batch(self) -> int:
        """The number of candidates per batch."""


class Need(NamedTuple):
    """A requirement of a sampler to a search.

    `message` follows the name of the sampler if `holds` is False.
    """

    holds: Callable[[Sought], bool]
    message: str


@dataclass(frozen=True)
class OfOptuna:
    """A maker of a sampler in `optuna.samplers`, by name.

    The maker imports optuna only in a call. The import takes a second.
    """

    name: str

    def __call__(self, **options: Any) -> "BaseSampler":
        """Return the sampler with options."""
        import optuna

        sampler: BaseSampler = getattr(optuna.samplers, self.name)(**options)
        return sampler


def no_options(_search: Sought) -> Options:
    """Return no options, so that the sampler gets only the seed."""
    return {}


@dataclass(frozen=True)
class SearchSampler:
    """A sampler of the candidates of a search.

    Attributes
    ----------
    make : callable
        Returns optuna's sampler from `seed`, of 32 bits, and the options.
    text : str
        Description of the sampler.
    options : callable
        Returns the options for a search, as plain values that are stored with the
        search.
    needs : tuple of Need
        Requirements to the search.
    """

    make: Callable[..., "BaseSampler"]
    text: str
    options: Callable[[Sought], Options] = no_options
    needs: tuple[Need, ...] = ()


def qmc(_search: Sought) -> Options:
    """Return the options of the scrambled Sobol sequence."""
    return {
        "qmc_type": "sobol",
        "scramble": True,
        "warn_asynchronous_seeding": False,
        "warn_independent_sampling": False,
    }


def tpe(search: Sought) -> Options:
    """Return the options of the tree-structured Parzen estimator.

    The estimator treats candidates without a result yet as bad candidates. The
    densities are joint for one objective. For several objectives, optuna's authors
    advise a density per parameter.
    """
    return {
        "n_startup_trials": 10,
        "n_ei_candidates": 24,
        "multivariate": len(search.objectives) == 1,
        "group": False,
        "constant_liar": True,
    }


def cmaes(search: Sought) -> Options:
    """Return the options of CMA-ES by batches.

    CMA-ES starts from the middle of the ranges, and the first batch is random.
    """
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


def gp(_search: Sought) -> Options:
    """Return the options of a Gaussian process with noise.

    The acquisition function is the logarithmic expected improvement.
    """
    return {
        "n_startup_trials": 10,
        "deterministic_objective": False,
        "warn_independent_sampling": False,
    }


def nsga2(search: Sought) -> Options:
    """Return the options of NSGA-II; a batch is the population."""
    return {
        "population_size": search.batch,
        "mutation": None,
        "mutation_prob": None,
        "crossover": None,
        "crossover_prob": 0.9,
        "swapping_prob": 0.5,
    }


def nsga3(search: Sought) -> Options:
    """Return the options of NSGA-III; a batch is the population.

    The reference points are on four levels of each objective.
    """
    return nsga2(search) | {"reference_points": None, "dividing_parameter": 3}


def _varied(search: Sought) -> int:
    """Return the number of parameters that have more than one value."""
    return sum(len(set(each.arguments)) > 1 for each in search.parameters)


ONE_OBJECTIVE = Need(
    lambda search: len(search.objectives) == 1,
    "allows a single objective: use nsga2, nsga3, tpe or random",
)
SEVERAL_OBJECTIVES = Need(
    lambda search: len(search.objectives) > 1,
    "is for several objectives: use nsga2 or tpe",
)
NO_CONSTRAINTS = Need(
    lambda search: not search.constraints,
    "supports no constraints: use tpe, nsga2 or nsga3",
)
NUMBERS = Need(
    lambda search: all(
        DISTRIBUTIONS[each.form].kind != "listed" for each in search.parameters
    ),
    "needs numerical parameters, without choice: use tpe",
)
TWO_PARAMETERS = Need(
    lambda search: _varied(search) >= 2,
    "needs two parameters or more: use tpe",
)
POPULATION = Need(
    lambda search: search.batch >= 2,
    "needs a batch (the population) of 2 or more",
)
TORCH = Need(
    lambda _search: find_spec("torch") is not None,
    f"needs torch: {installing('gp')}",
)

SEARCH_SAMPLERS: dict[str, SearchSampler] = {
    "random": SearchSampler(OfOptuna("RandomSampler"), "independent draws"),
    "qmc": SearchSampler(OfOptuna("QMCSampler"), "the scrambled Sobol sequence", qmc),
    "tpe": SearchSampler(
        OfOptuna("TPESampler"), "tree-structured Parzen estimator", tpe
    ),
    "cmaes": SearchSampler(
        OfOptuna("CmaEsSampler"),
        "CMA-ES, for a single objective, without constraints and choices",
        cmaes,
        (ONE_OBJECTIVE, NO_CONSTRAINTS, NUMBERS, TWO_PARAMETERS),
    ),
    "gp": SearchSampler(
        OfOptuna("GPSampler"), "Gaussian process, which needs torch", gp, (TORCH,)
    ),
    "nsga2": SearchSampler(
        OfOptuna("NSGAIISampler"),
        "NSGA-II, with the batch as the population",
        nsga2,
        (POPULATION,),
    ),
    "nsga3": SearchSampler(
        OfOptuna("NSGAIIISampler"),
        "NSGA-III, for several objectives, with the batch as the population",
        nsga3,
        (SEVERAL_OBJECTIVES, POPULATION),
    ),
}
"""Samplers by the names in specs."""
FOR_ONE = "tpe"
"""Sampler of a single objective, if a spec names no sampler."""
FOR_SEVERAL = "nsga2"
"""Sampler of several objectives, if a spec names no sampler."""
PLAIN = "random"
"""Sampler of the random searches to which repetitions of a search are compared."""
