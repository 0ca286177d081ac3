"""Stamps of code: what changes them, and whom it concerns."""

import ast
import importlib
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from kernels import stamps
from kernels.catalogue import BUILT_IN
from kernels.identity import FLIGHT, Code, code_of
from kernels.metrics import METRICS
from kernels.model import Model
from kernels.models import MODELS
from kernels.stamps import Definition, closure, stamp, stamp_of_texts
from kernels.starts import STARTS
from kernels.worlds import MAPS
from tests import ROOT

ONE = '''
"""A module."""
from typing import NamedTuple

from own.two import SCALE, scaled, unused
from own import three
from . import four
from own.six import *

FACTOR: float = 2.0
NAMES = ["a"]
NAMES.append("b")


class Pair(NamedTuple):
    """Two numbers."""

    first: float
    second: float = 1.0


def alone(x: float) -> float:
    """Uses nothing."""
    return x + 1.0


def all_of_it(x: float) -> float:
    # A comment.
    from own.five import late

    return three.deep(scaled(x) * FACTOR + SCALE) + four.plus(Pair(x).first) + late(x)


def mutual(x: float) -> float:
    return x if x < 0 else other(x)


def other(x: float) -> float:
    return mutual(x - 1.0)


def starred(x: float) -> float:
    return faraway(x)
'''
OTHERS = {
    "two": "SCALE = 3.0\n\ndef scaled(x): return inner(x)\n\ndef inner(x): return x"
    "\n\ndef unused(x): return x\n",
    "three": "from own.two import inner as again\n\ndef deep(x): return again(x)\n",
    "four": "OFFSET = {}\nOFFSET['x'] = 4.0\n\ndef plus(x): return x + OFFSET['x']\n",
    "five": "def late(x): return x\n",
    "six": "from own.seven import *\nfrom own.one import *\n",
    "seven": "if True:\n    def faraway(x):\n        y = 1.0 * x\n        return y\n",
}

Reader = Callable[[str], dict[str, str]]


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a package of modules, which is forgotten afterwards."""
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "one.py").write_text(ONE)
    for name, code in OTHERS.items():
        (folder / f"{name}.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    yield folder
    forget()


def forget() -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == "own"]:
        del sys.modules[name]
    for cached in vars(stamps).values():
        if hasattr(cached, "cache_clear"):
            cached.cache_clear()


def all_stamps() -> dict[str, str]:
    """The stamp of each function of `one`, read anew."""
    forget()
    importlib.invalidate_caches()
    one = importlib.import_module("own.one")
    importlib.import_module("own.five")
    names = ("alone", "all_of_it", "mutual", "other", "starred")
    return {name: stamp(getattr(one, name)) for name in names}


def edited(folder: Path, module: str, old: str, new: str) -> set[str]:
    """The functions whose stamps an edit changes."""
    before, path = all_stamps(), folder / f"{module}.py"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    after = all_stamps()
    return {name for name in before if before[name] != after[name]}


CHANGES = {
    "its own code": ("one", "x + 1.0", "x + 2.0", {"alone"}),
    "a constant": ("one", "FACTOR: float = 2.0", "FACTOR: float = 2.5", {"all_of_it"}),
    "a constant elsewhere": ("two", "SCALE = 3.0", "SCALE = 4.0", {"all_of_it"}),
    "what is called by what is called": (
        "two",
        "def inner(x): return x",
        "def inner(x): return -x",
        {"all_of_it"},
    ),
    "under another name": (
        "three",
        "again(x)",
        "again(x) + 1",
        {"all_of_it"},
    ),
    "by a relative import": ("four", "x + OFFSET", "x - OFFSET", {"all_of_it"}),
    "what is put into a table": ("four", "= 4.0", "= 5.0", {"all_of_it"}),
    "what is imported within": ("five", "return x", "return -x", {"all_of_it"}),
    "a default of a class": (
        "one",
        "second: float = 1.0",
        "second: float = 2.0",
        {"all_of_it"},
    ),
    "one of two that call each other": (
        "one",
        "x - 1.0",
        "x - 2.0",
        {"mutual", "other"},
    ),
    "what a module does": (
        "one",
        'append("b")',
        'append("c")',
        {"alone", "all_of_it", "mutual", "other", "starred"},
    ),
    "what import * brings": ("seven", "y = 1.0 * x", "y = 2.0 * x", {"starred"}),
    "what nobody calls": (
        "two",
        "def unused(x): return x",
        "def unused(x): pass",
        set(),
    ),
    "another function": (
        "two",
        "def unused",
        "def more(x): return x\n\ndef unused",
        set(),
    ),
    "a docstring": ("one", '"""Uses nothing."""', '"""Adds one."""', set()),
    "a comment": ("one", "# A comment.", "# Another.", set()),
    "an annotation": ("one", "def alone(x: float)", "def alone(x: int)", set()),
    "layout": ("one", "    return x + 1.0", "\n    return (x +\n        1.0)", set()),
}


@pytest.mark.parametrize("name", CHANGES)
def test_an_edit_changes_the_stamps_of_those_who_use_it(
    own: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In our package, which is taken apart."""
    monkeypatch.setattr(stamps, "OURS", "own")
    module, old, new, concerned = CHANGES[name]
    assert edited(own, module, old, new) == concerned


NO_CODE = ("a docstring", "a comment", "an annotation", "layout")


@pytest.mark.parametrize("name", CHANGES)
def test_an_edit_of_code_that_is_not_ours_concerns_all_of_its_module(
    own: Path, name: str
) -> None:
    module, old, new, _ = CHANGES[name]
    concerned = {"alone", "all_of_it", "mutual", "other", "starred"}
    assert edited(own, module, old, new) == (set() if name in NO_CODE else concerned)


HIDDEN = {
    "a name that is bound again": (
        "from .two import SCALE\nSCALE = SCALE * {}",
        "2",
        "3",
    ),
    "a value put into another module": (
        "from . import four\nfour.A = {}",
        "5.0",
        "6.0",
    ),
    "a loop": ("W = []\nfor k in range({}):\n    W.append(k)", "3", "4"),
    "one of two imports": (
        "try:\n    from .two import {}\nexcept ImportError:\n    from .six import {}",
        "scaled",
        "unused",
    ),
    "a function that is wrapped": (
        "def by(c):\n    def of(f):\n        def g(x): return c * f(x)\n"
        "        return g\n    return of\n\n@by({})\ndef wrapped(x): return x",
        "2.0",
        "3.0",
    ),
    "a condition": (
        "if True:\n    def some(x):\n        y = {}\n        return y",
        "1",
        "2",
    ),
    "an order": ("P = [1, 2]\nA, B = P.pop({}), P.pop()", "0", "1"),
    "a method": ("class C:\n    def rate(self): return {}", "1.0", "2.0"),
    "a text that is run": ("exec('Q = {}')", "1", "2"),
}


@pytest.mark.parametrize("name", HIDDEN)
def test_nothing_that_a_module_does_is_missed(own: Path, name: str) -> None:
    code, old, new = HIDDEN[name]
    with (own / "one.py").open("a") as file:
        file.write(code.replace("{}", old) + "\n")
    changed = edited(own, "one", code.replace("{}", old), code.replace("{}", new))
    assert changed == {"alone", "all_of_it", "mutual", "other", "starred"}


def test_what_is_read_when_a_module_is_imported_counts(own: Path) -> None:
    (own / "gain.txt").write_text("1.0")
    with (own / "two.py").open("a") as file:
        file.write("from pathlib import Path\n")
        file.write("GAIN = float((Path(__file__).parent / 'gain.txt').read_text())\n")
    before = all_stamps()
    assert all_stamps() == before
    (own / "gain.txt").write_text("9.0")
    assert {name for name, one in all_stamps().items() if one != before[name]} == {
        *before
    }


def test_a_module_that_is_imported_later_counts_before_it_is(own: Path) -> None:
    with (own / "one.py").open("a") as file:
        file.write("def lazy(x):\n    from .eight import far\n    return far(x)\n")
    (own / "eight.py").write_text("def far(x): return x\n")
    before = all_stamps()
    importlib.import_module("own.eight")
    assert stamp(sys.modules["own.one"].lazy) == stamp(sys.modules["own.one"].lazy)
    assert edited(own, "eight", "return x", "return -x") == {*before}


def test_what_is_said_of_entries_is_no_code(own: Path) -> None:
    with (own / "one.py").open("a") as file:
        file.write("METRICS = dict()\nMETRICS = {'a': ('text', alone)}\n")
    assert edited(own, "one", "'text'", "'other text'") == set()


def test_a_partial_function_is_given_plain_values() -> None:
    with pytest.raises(ValueError, match="given more than numbers and texts"):
        stamp(partial(stamp, alone_in_tests))
    given = ((1.0, 2.0), (0.1 + 1e-12, 3.0)), ((1.0, 2.0), (0.1, 3.0))
    long = np.zeros(10_000), np.eye(1, 10_000, 5_000)[0]
    for pair in (given, long):
        one, other = (stamp(partial(alone_in_tests, places)) for places in pair)
        assert one != other


def alone_in_tests() -> None:
    """A function."""


def test_a_function_within_another_has_no_stamp() -> None:
    def inner(x: float) -> float:
        return x

    with pytest.raises(ValueError, match="no function at the top of a module"):
        stamp(inner)


def names_of(function: Callable[..., object]) -> set[str]:
    """The modules in what a function uses."""
    plain = getattr(function, "py_func", function)
    return {
        one.module for one in closure([Definition(plain.__module__, plain.__name__)])
    }


def test_models_metrics_and_maps_use_no_other() -> None:
    """So that one that is added, or edited, changes no other."""
    for model in MODELS.values():
        used = names_of(model.advance)
        assert {name for name in used if name.startswith("kernels.models.")} == {
            f"kernels.models.{model.name}"
        }
        assert not any(name.startswith("kernels.metrics") for name in used)
    tables = (METRICS, "kernels.models"), (MAPS, "kernels.metrics")
    for table, others in (*tables, (STARTS, "kernels.m")):
        for entry in table.values():
            used = names_of(entry[0])
            assert not any(name.startswith(others) for name in used)
    for function in FLIGHT:
        used = names_of(function) - {"kernels.metrics.ground", "kernels.metrics.parts"}
        assert not any(
            name.startswith(("kernels.models.", "kernels.metrics.")) for name in used
        )


def test_where_compiled_kernels_are_kept_concerns_no_stamp() -> None:
    advancing = [model.advance for model in MODELS.values()]
    for function in (*advancing, *FLIGHT):
        assert "kernels.caching" not in names_of(function)


def test_a_rule_concerns_the_models_that_import_it() -> None:
    using = {
        name
        for name, model in MODELS.items()
        if "kernels.rules.avoidance" in names_of(model.advance)
    }
    importing = {
        name
        for name in MODELS
        if "kernels.rules.avoidance"
        in (ROOT / "kernels" / "models" / f"{name}.py").read_text()
    }
    assert using == importing != set()


@pytest.mark.parametrize("said", [{"update_order": "all at once"}, {"source": "me"}])
def test_what_a_model_says_in_words_changes_no_id(said: dict[str, str]) -> None:
    model = MODELS["nguyen2024"]
    names = (("nguyen2024", "as_run"),)

    def stamped(one: Model) -> Code:
        known = replace(BUILT_IN, models={one.name: one})
        return code_of(known, names, ["speed"], ["empty"], ["numpy"])

    assert stamped(model._replace(**said)) == stamped(model)
    assert stamped(model._replace(kinds=("prey",))) != stamped(model)


def test_all_that_runs_a_trial_has_a_stamp() -> None:
    """Every kernel that the trial package calls is in FLIGHT."""
    named = {(one.__module__, one.__name__) for one in FLIGHT}
    for name in ("simulation", "scenery", "state", "generators"):
        text = (ROOT / "sweep" / "trial" / f"{name}.py").read_text()
        for module, names in re.findall(
            r"^from (kernels\.(?:flight|starts|coverage|events|recording)) import"
            r" (\([^)]*\)|.*)$",
            text,
            re.MULTILINE,
        ):
            for one in re.findall(r"\b[a-z_]\w*", names):
                assert (module, one) in named


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("""x = f"{', '.join(a)}: {n}\"""", """f"{', '.join(a)}: {n}\""""),
        ("x = f'{n:.1f} {m!r}'", "f'{n:.1f} {m!r}'"),
        ("""x = f"it's {n}\"""", """f"it's {n}\""""),
        ("""x = f'{a["one"]} {b}'""", """f"{a['one']} {b}\""""),
        ("""x = f"{f'{n}'} of {'m'}\"""", """f\"{f'{n}'} of {'m'}\""""),
    ],
)
def test_code_is_written_out_alike_by_every_version_of_python(
    code: str, said: str
) -> None:
    """As Python 3.11 does: ids of trials follow from it. 3.12 has other quotes."""
    assert stamps.written_out(ast.parse(code)) == f"x = {said}"


@pytest.mark.parametrize(
    ("changed", "same"),
    [
        ("MODEL = Model(name='a', publishes=True, shared=('dt',))", True),
        ("MODEL = Model(name='a', y_down=False)", False),
        ("MODEL = Other(name='a', publishes=True)", False),
        ("class Model(NamedTuple):\n    name: str\n    drives: bool = True", True),
        ("class Model(NamedTuple):\n    name: str\n    state: bool = True", False),
        ("class Other(NamedTuple):\n    name: str\n    drives: bool = True", False),
    ],
)
def test_what_a_model_declares_of_its_robots_leaves_trials_valid(
    changed: str, same: bool
) -> None:
    before = {
        "MODEL": "MODEL = Model(name='a')",
        "class Model": "class Model(NamedTuple):\n    name: str",
        "class Other": "class Other(NamedTuple):\n    name: str",
    }
    (text,) = [text for name, text in before.items() if changed.startswith(name)]
    stamps = {stamp_of_texts([("own.py", one)]) for one in (text, changed)}
    assert (len(stamps) == 1) == same
