"""The samplers of a search, which propose its candidates: optuna's, with every option
that counts said here, whatever optuna's defaults.

To add one, write a function of its options and enter it in SEARCH_SAMPLERS.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.objectives import Constraint, Objective
from sweep.text import installing

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler

Options = dict[str, Any]
"""The options of one of optuna's samplers by name, plain values."""


class Sought(Protocol):
    """What a sampler may ask of a search, see `sweep.spec.search.Search`."""

    @property
    def parameters(self) -> tuple[Any, ...]: ...
    @property
    def objectives(self) -> tuple[Objective, ...]: ...
    @property
    def constraints(self) -> tuple[Constraint, ...]: ...
    @property
    def batch(self) -> int: ...


class Need(NamedTuple):
    """What a sampler needs of a search, and what to say where it does not have it,
    after the name of the sampler.
    """

    holds: Callable[[Sought], bool]
    message: str


@dataclass(frozen=True)
class OfOptuna:
    """Makes the sampler of that name in `optuna.samplers`.

    It imports optuna only then, which takes a second.
    """

    name: str

    def __call__(self, **options: Any) -> "BaseSampler":
        """The sampler with these options."""
        import optuna

        made: BaseSampler = getattr(optuna.samplers, self.name)(**options)
        return made


def no_options(_search: Sought) -> Options:
    """None beside the seed."""
    return {}


@dataclass(frozen=True)
class SearchSampler:
    """What proposes the candidates of a search: how it is made, and what it needs.

    `make(seed=..., **options)` gives a sampler of optuna, with a seed of 32 bits and
    the options that `options` has for a search; these are plain values, and stored with
    it. `text` says what it is.
    """

    make: Callable[..., "BaseSampler"]
    text: str
    options: Callable[[Sought], Options] = no_options
    needs: tuple[Need, ...] = ()


def qmc(_search: Sought) -> Options:
    """The scrambled Sobol sequence."""
    return {
        "qmc_type": "sobol",
        "scramble": True,
        "warn_asynchronous_seeding": False,
        "warn_independent_sampling": False,
    }


def tpe(search: Sought) -> Options:
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


def cmaes(search: Sought) -> Options:
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


def gp(_search: Sought) -> Options:
    """A Gaussian process with noise, and logarithmic expected improvement."""
    return {
        "n_startup_trials": 10,
        "deterministic_objective": False,
        "warn_independent_sampling": False,
    }


def nsga2(search: Sought) -> Options:
    """NSGA-II, a batch being its population."""
    return {
        "population_size": search.batch,
        "mutation": None,
        "mutation_prob": None,
        "crossover": None,
        "crossover_prob": 0.9,
        "swapping_prob": 0.5,
    }


def nsga3(search: Sought) -> Options:
    """NSGA-III, a batch being its population, with reference points on four levels of
    each objective.
    """
    return nsga2(search) | {"reference_points": None, "dividing_parameter": 3}


def _varied(search: Sought) -> int:
    """How many parameters have more than one value."""
    return sum(len(set(one.arguments)) > 1 for one in search.parameters)


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
        DISTRIBUTIONS[one.form].kind != "listed" for one in search.parameters
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
"""By their names in specs."""
FOR_ONE, FOR_SEVERAL = "tpe", "nsga2"
"""What a spec has that names none, for one objective and for several."""
PLAIN = "random"
"""What repetitions of a search are compared with."""
