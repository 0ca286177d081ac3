"""Samplers of a search, which propose its candidates.

They are optuna's. Every option that matters is given here, whatever optuna's default.
To add one, write a function of its options and enter it in SEARCH_SAMPLERS.
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
"""Options of one of optuna's samplers by name, plain values."""


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
    """A maker of the sampler of a name in `optuna.samplers`.

    It imports optuna only when it is called. The import takes a second.
    """

    name: str

    def __call__(self, **options: Any) -> "BaseSampler":
        """Return the sampler with these options."""
        import optuna

        sampler: BaseSampler = getattr(optuna.samplers, self.name)(**options)
        return sampler


def no_options(_search: Sought) -> Options:
    """Return no options beside the seed."""
    return {}


@dataclass(frozen=True)
class SearchSampler:
    """A sampler of the candidates of a search.

    Attributes
    ----------
    make
        Returns optuna's sampler from `seed`, of 32 bits, and the options.
    text
        Description of the sampler.
    options
        Returns the options for a search. They are plain values, stored with the search.
    needs
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

    It treats candidates without a result yet as bad ones. Its densities are joint for
    one objective. For several, optuna's authors advise a density per parameter.
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

    It starts from the middle of the ranges, and its first batch is random.
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

    Its acquisition function is the logarithmic expected improvement.
    """
    return {
        "n_startup_trials": 10,
        "deterministic_objective": False,
        "warn_independent_sampling": False,
    }


def nsga2(search: Sought) -> Options:
    """Return the options of NSGA-II; a batch is its population."""
    return {
        "population_size": search.batch,
        "mutation": None,
        "mutation_prob": None,
        "crossover": None,
        "crossover_prob": 0.9,
        "swapping_prob": 0.5,
    }


def nsga3(search: Sought) -> Options:
    """Return the options of NSGA-III; a batch is its population.

    Its reference points lie on four levels of each objective.
    """
    return nsga2(search) | {"reference_points": None, "dividing_parameter": 3}


def _varied(search: Sought) -> int:
    """Return the number of parameters that have more than one value."""
    return sum(len(set(each.arguments)) > 1 for each in search.parameters)


ONE_OBJECTIVE = Need(
    lambda search: len(search.objectives) == 1,
    "has one objective: use nsga2, nsga3, tpe or random",
)
SEVERAL_OBJECTIVES = Need(
    lambda search: len(search.objectives) > 1,
    "is for several objectives: use nsga2 or tpe",
)
NO_CONSTRAINTS = Need(
    lambda search: not search.constraints,
    "knows no constraints: use tpe, nsga2 or nsga3",
)
NUMBERS = Need(
    lambda search: all(
        DISTRIBUTIONS[each.form].kind != "listed" for each in search.parameters
    ),
    "needs numbers, and no choice: use tpe",
)
TWO_PARAMETERS = Need(
    lambda search: _varied(search) >= 2,
    "needs two parameters or more: use tpe",
)
POPULATION = Need(
    lambda search: search.batch >= 2,
    "needs a batch, which is its population, of 2 or more",
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
        "CMA-ES, of one objective, without constraints and choices",
        cmaes,
        (ONE_OBJECTIVE, NO_CONSTRAINTS, NUMBERS, TWO_PARAMETERS),
    ),
    "gp": SearchSampler(
        OfOptuna("GPSampler"), "Gaussian process, which needs torch", gp, (TORCH,)
    ),
    "nsga2": SearchSampler(
        OfOptuna("NSGAIISampler"),
        "NSGA-II, a batch being its population",
        nsga2,
        (POPULATION,),
    ),
    "nsga3": SearchSampler(
        OfOptuna("NSGAIIISampler"),
        "NSGA-III, of several objectives, a batch being its population",
        nsga3,
        (SEVERAL_OBJECTIVES, POPULATION),
    ),
}
"""Samplers by their names in specs."""
FOR_ONE = "tpe"
"""Sampler of one objective, if a spec names none."""
FOR_SEVERAL = "nsga2"
"""Sampler of several objectives, if a spec names none."""
PLAIN = "random"
"""Sampler that repetitions of a search are compared with."""
