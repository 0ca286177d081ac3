"""Samplers: every one proposes candidates for a small real search, with options that
are said and recorded.
"""

import inspect
import subprocess
import sys
import warnings
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import optuna
import pytest

from sweep.methods.search.known_samplers import SEARCH_SAMPLERS, OfOptuna
from sweep.methods.search.samplers import (
    distributions,
    new_study,
    quiet,
    size_of,
)
from sweep.methods.search.section_keys import Parameter, Search
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.cases import slow_but
from tests.searches import TINY, asked_by, edited, equal, phase

TWO = edited(
    TINY,
    (
        "flock_radius: {minimize: mean}",
        "flock_radius: {minimize: mean}\n    speed: {maximize: mean}",
    ),
)
NOT_SAID = {"seed", "independent_sampler", "constraints_func"}
"""Options that are the seed, another sampler, or what trials say by themselves."""


def with_sampler(spec: str, name: str) -> str:
    return edited(spec, ("  budget: 30", f"  sampler: {name}\n  budget: 30"))


def search_of(spec: str) -> Search:
    search = parse_spec(spec).sections["search"]
    assert search is not None
    return search


@pytest.mark.parametrize("name", slow_but(["cmaes", "nsga3"], SEARCH_SAMPLERS))
def test_a_search_runs_with_every_sampler_again_and_again(
    tmp_path: Path, name: str
) -> None:
    if name == "gp" and find_spec("torch") is None:
        pytest.skip("gp needs torch")
    spec = with_sampler(TWO if name == "nsga3" else TINY, name)
    spec = edited(spec, ("budget: 30", "budget: 18"))
    first = asked_by(spec, tmp_path / "1")
    equal(asked_by(spec, tmp_path / "2"), first)
    rows = phase(first)
    assert len(rows) == 18
    assert rows["separation_weight"].between(0, 3).all()
    assert rows["cohesion_weight"].between(0.01, 1).all()
    assert rows["candidate"].nunique() > 5
    assert first.description["sampler"] == name
    assert first.description["options"] == SEARCH_SAMPLERS[name].options(
        search_of(spec)
    )


@pytest.mark.parametrize(
    "name", slow_but(["qmc", "nsga2"], ["random", "qmc", "tpe", "nsga2"])
)
def test_several_objectives_choices_and_rejected_candidates(
    tmp_path: Path, name: str
) -> None:
    spec = edited(
        with_sampler(TWO, name),
        ("  budget", "  constraints: {speed: {at_least: 0.5}}\n  budget"),
        (
            "separation_weight: {uniform: [0, 3]}",
            "separation_weight: {choice: [0.5, 1, 2]}",
        ),
        (
            "replicates: 4",
            "require: [separation_weight >= 2 * cohesion_weight]\nreplicates: 4",
        ),
    )
    asked = asked_by(spec, tmp_path)
    assert set(asked.table["separation_weight"]) <= {0.5, 1, 2}
    assert (
        asked.table["separation_weight"] >= 2 * asked.table["cohesion_weight"]
    ).all()
    assert asked.description["rejected"]["search"] > 0


@pytest.mark.parametrize("name", SEARCH_SAMPLERS)
def test_every_option_of_optuna_is_said(name: str) -> None:
    """All but those that optuna has deprecated, which it
    warns of when they are given.
    """
    made = SEARCH_SAMPLERS[name].make
    assert isinstance(made, OfOptuna)
    known = inspect.signature(getattr(optuna.samplers, made.name).__init__).parameters
    said = SEARCH_SAMPLERS[name].options(search_of(TWO))
    assert set(said) <= set(known)
    for option in set(known) - {"self"} - NOT_SAID - set(said):
        assert is_deprecated(name, option), f"{name}: {option}"


def is_deprecated(name: str, option: str) -> bool:
    """Whether optuna warns of an option, or takes a strategy for it that is
    experimental.
    """
    values: dict[str, Any] = {"gamma": lambda n: n, "weights": lambda n: n}
    if (
        option.endswith("_strategy")
        or option == "inc_popsize"
        or option == "restart_strategy"
    ):
        return True
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        SEARCH_SAMPLERS[name].make(**{option: values.get(option, True)})
    return any(issubclass(one.category, FutureWarning) for one in caught)


def test_the_seed_makes_the_candidates() -> None:
    search = search_of(TINY)
    ranges = distributions(search.parameters)
    drawn = [new_study("tpe", search, seed).ask(ranges).params for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1] != drawn[2]


def test_optuna_is_quiet_only_meanwhile(capfd: pytest.CaptureFixture[str]) -> None:
    before = optuna.logging.get_verbosity()
    with quiet():
        study = new_study("tpe", search_of(TINY), 1)
        study.tell(study.ask(), 1.0)
    assert optuna.logging.get_verbosity() == before
    assert capfd.readouterr() == ("", "")


def test_optuna_asks_for_no_widgets_in_a_notebook() -> None:
    """In a process of its own, since optuna is imported only once."""
    script = """if True:
        import sys, types, IPython
        sys.modules["ipykernel.zmqshell"] = types.ModuleType("shell")
        sys.modules["ipywidgets"] = None
        from sweep.methods.search.samplers import quiet
        with quiet():
            print("optuna" in sys.modules)
    """
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True
    )
    assert (done.stdout, done.stderr) == ("True\n", "")


@pytest.mark.parametrize(
    ("parameters", "size"),
    [
        ([("choice", (1.0, 2.0)), ("integers", (3, 7))], 10),
        ([("uniform", (1.0, 1.0)), ("integers", (3, 3))], 1),
        ([("uniform", (1.0, 1.5)), ("integers", (3, 3))], float("inf")),
    ],
)
def test_the_size_of_a_space(
    parameters: list[tuple[str, tuple[float, ...]]], size: float
) -> None:
    assert (
        size_of(
            tuple(Parameter("n", form, arguments) for form, arguments in parameters)
        )
        == size
    )


def test_ranges_are_asked_as_written() -> None:
    ranges = distributions(
        (
            Parameter("a", "loguniform", (0.1, 1.0)),
            Parameter("b", "integers", (2, 5)),
            Parameter("c", "choice", ("x", "y")),
        )
    )
    assert ranges == {
        "a": optuna.distributions.FloatDistribution(0.1, 1.0, log=True),
        "b": optuna.distributions.IntDistribution(2, 5),
        "c": optuna.distributions.CategoricalDistribution(("x", "y")),
    }
