"""An edit of an own file runs again what it concerns, and nothing else; all processes
compute the same numbers.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

import sweep
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.worlds import MAPS
from sweep.campaigns.launching import launch
from sweep.design.code import study_code
from sweep.errors import SpecError
from sweep.own_code.catalogue import _loaded
from sweep.own_code.reading import load_spec, named_model
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Loky
from tests import ROOT
from tests.cases import slow_but
from tests.commands import run_trials_here
from tests.own_models import (
    OTHER_METRIC,
    OTHER_RULE,
    OTHER_WORDS,
    SPEC,
    edited,
    written,
)
from tests.studies import launched, read, relaunch, same

PLAIN = (
    SPEC.replace("./drawn.py", "drawn")
    .replace("./places.py", "pillar")
    .replace("./mine.py", "rightwards")
)
"""The same spec where the entries are built in."""


@pytest.fixture
def two_workers() -> Iterator[Loky]:
    engine = Loky(2)
    yield engine
    engine.stop()


@pytest.fixture(params=slow_but([1], [1, 2]))
def workers(request: pytest.FixtureRequest) -> Iterator[Loky]:
    """Workers that share the trials of a test."""
    engine = Loky(request.param)
    yield engine
    engine.stop()


def test_workers_compute_what_the_same_model_computes_built_in(
    tmp_path: Path, workers: Loky, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Number for number: the example in place of its copy, in one process."""
    spec = written(tmp_path)
    own = launched(spec, tmp_path / "own", workers)
    known = load_spec(spec).catalogue
    presets = known.models["drawn"].presets
    name, there = named_model(str(ROOT / "examples" / "vortex.py"))
    entry = there.models[name]._replace(name="drawn", presets=presets)
    monkeypatch.setitem(MODELS, "drawn", entry)
    monkeypatch.setitem(METRICS, "rightwards", known.metrics["rightwards"])
    monkeypatch.setitem(MAPS, "pillar", known.maps["pillar"])
    whole = launched(PLAIN, tmp_path / "built_in")
    assert own.statuses() == whole.statuses() == {"done": 6}
    assert same(own, whole)
    assert own.units == whole.units


def test_a_rule_in_a_helper_file_runs_exactly_its_trials_again(tmp_path: Path) -> None:
    """Those of a study without the model stay, and the old ones are found again when
    the edit is undone.
    """
    spec, results = written(tmp_path), tmp_path / "results"
    other = tmp_path / "other.yaml"
    text = SPEC.replace("study: drawn", "study: other")
    other.write_text(text.replace("./drawn.py", "nguyen2024"))
    before = launched(spec, results)
    assert relaunch(other, results).statuses.total() == 6
    edited(tmp_path, *OTHER_RULE)
    assert relaunch(spec, results).statuses.total() == 6
    assert relaunch(other, results).statuses.total() == 0
    after = StoredStudy("drawn", results)
    assert set(after.plan["trial_id"].to_pylist()).isdisjoint(
        before.plan["trial_id"].to_pylist()
    )
    assert not same(before, after)
    edited(tmp_path, *reversed(OTHER_RULE))
    assert relaunch(spec, results).statuses.total() == 0
    assert same(StoredStudy("drawn", results), before)


WAYS = {
    "import *": ("from .rules import cohesion", "from .rules import *"),
    "a module": (
        "from .rules import cohesion",
        "from . import rules\n\ncohesion = rules.cohesion",
    ),
    "getattr": (
        "from .rules import cohesion",
        "from . import rules\n\ncohesion = getattr(rules, 'cohesion')",
    ),
    "another file": ("from .rules import cohesion", "from .more import cohesion"),
    "all of another file": ("from .rules import cohesion", "from .all import *"),
}


@pytest.mark.parametrize("way", WAYS)
def test_an_edit_is_noticed_whichever_way_leads_to_it(tmp_path: Path, way: str) -> None:
    spec = written(tmp_path, WAYS[way])
    (tmp_path / "more.py").write_text("from .rules import cohesion\n")
    (tmp_path / "all.py").write_text("from .rules import *\nfrom .all import *\n")
    before = study_code(read(spec))
    edited(tmp_path, *OTHER_RULE)
    assert before.changes(study_code(read(spec))) == ["model drawn as_run"]


SIGHT = "    sight=sight,"
MADE = "\n\ndef made(share):\n    return lambda params: sight(params)\n\n\nMODEL ="


def test_an_edit_of_a_lambda_is_noticed(tmp_path: Path) -> None:
    new = "    sight=lambda params: Sight(params.perception_range),"
    spec = written(tmp_path, (SIGHT, new))
    before = study_code(read(spec))
    edited(tmp_path, new, new.replace("range)", "range / 2)"))
    assert before.changes(study_code(read(spec))) == ["model drawn as_run"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ((SIGHT, "    sight=made(2),"), '"sight" of drawn'),
        ((SIGHT, "    sight=Params.__new__,"), '"sight" of drawn'),
    ],
    ids=["a function within another", "a method"],
)
def test_a_function_whose_edits_would_be_missed_is_refused(
    tmp_path: Path, change: tuple[str, str], said: str
) -> None:
    spec = written(tmp_path, change, ("\nMODEL =", MADE))
    with pytest.raises(SpecError, match=f"drawn.py: {said} is no function at the top"):
        read(spec)


def test_other_words_run_nothing(tmp_path: Path) -> None:
    spec, results = written(tmp_path), tmp_path / "results"
    before = launched(spec, results)
    for old, new in OTHER_WORDS:
        edited(tmp_path, old, new)
    assert relaunch(spec, results).statuses.total() == 0
    assert same(StoredStudy("drawn", results), before)


@pytest.mark.slow
def test_an_extension_after_other_words_runs_what_is_new(tmp_path: Path) -> None:
    """And has the tables of a launch of the whole; each row is run again by the text
    that computed it.
    """
    spec, results = written(tmp_path), tmp_path / "results"
    launched(spec, results)
    for old, new in OTHER_WORDS:
        edited(tmp_path, old, new)
    edited(tmp_path, "replicates: 3", "replicates: 4")
    assert relaunch(spec, results).statuses.total() == 2
    extended = StoredStudy("drawn", results)
    assert same(extended, launched(spec, tmp_path / "whole"))
    texts = {
        extended.running(extended.trial(trial).provenance).runs
        for trial in extended.plan["trial_id"].to_pylist()
    }
    assert texts == {("drawn.py", "mine.py", "places.py", "rules.py")}
    codes = {
        extended.trial(trial).provenance["own"]["sha"]
        for trial in extended.plan["trial_id"].to_pylist()
    }
    assert len(codes) == 2


@pytest.mark.slow
def test_a_metric_runs_again_only_what_records_it(tmp_path: Path) -> None:
    spec, results = written(tmp_path), tmp_path / "results"
    without = tmp_path / "without.yaml"
    text = SPEC.replace("study: drawn", "study: without")
    without.write_text(
        text.replace("[./mine.py]", "[speed]").replace(", rightwards", "")
    )
    before = launched(spec, results)
    assert relaunch(without, results).statuses.total() == 6
    edited(tmp_path, *OTHER_METRIC)
    assert relaunch(without, results).statuses.total() == 0
    assert relaunch(spec, results).statuses.total() == 6
    after = StoredStudy("drawn", results)
    pd.testing.assert_series_equal(
        after.trials["rightwards"], 2 * before.trials["rightwards"]
    )
    assert after.trials["speed"].equals(before.trials["speed"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("named", "file", "new"),
    [("./{}.py", "places", "rooms"), ("from .{}", "rules", "pulls")],
)
def test_a_file_of_another_name_computes_the_same(
    tmp_path: Path, named: str, file: str, new: str
) -> None:
    """Its trials are other ones, since a stamp has the names of modules."""
    spec, results = written(tmp_path), tmp_path / "results"
    before = launched(spec, results)
    edited(tmp_path, named.format(file), named.format(new))
    (tmp_path / f"{file}.py").rename(tmp_path / f"{new}.py")
    assert relaunch(spec, results).statuses.total() == 6
    assert same(StoredStudy("drawn", results), before)


@pytest.mark.slow
def test_a_model_of_another_name_is_another_model(tmp_path: Path) -> None:
    spec, results = written(tmp_path), tmp_path / "results"
    before = launched(spec, results)
    edited(tmp_path, 'name="drawn"', 'name="painted"')
    assert relaunch(spec, results).statuses.total() == 6
    after = StoredStudy("drawn", results)
    assert set(after.trials["model"]) == {"painted"}
    assert set(before.plan["point"].to_pylist()).isdisjoint(
        after.plan["point"].to_pylist()
    )


def test_an_edit_between_two_runs_of_one_process_gives_new_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_trials_here(monkeypatch)
    spec, results = written(tmp_path), tmp_path / "results"
    first = sweep.run(spec, results, workers=1)
    edited(tmp_path, *OTHER_RULE)
    assert sweep.plan(spec).trials == 6
    second = sweep.run(spec, results, workers=1)
    fresh = written(tmp_path / "fresh", OTHER_RULE)
    whole = launched(fresh, tmp_path / "fresh")
    assert same(StoredStudy("drawn", results), whole)
    assert not second.trials["speed"].equals(first.trials["speed"])


@pytest.mark.slow
def test_a_model_that_was_put_among_ours_by_hand_runs_in_workers_from_its_file(
    tmp_path: Path, two_workers: Loky, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a worker process there is no such entry: every trial fails there. The file of
    the same model, named in the spec, runs.
    """
    spec = written(tmp_path)
    known = load_spec(spec).catalogue
    by_hand = known.models["drawn"]
    plain = SPEC.replace("./drawn.py", "by_hand").replace(", map: ./places.py", "")
    plain = plain.replace("[./mine.py]", "[speed]").replace(", rightwards", "")
    monkeypatch.setitem(MODELS, "by_hand", by_hand._replace(name="by_hand"))
    done = launch(parse_spec(plain), tmp_path / "by_hand", two_workers)
    assert done.statuses == {"failed": 6}
    assert launched(spec, tmp_path / "own", two_workers).statuses() == {"done": 6}


def test_a_package_that_is_imported_again_has_the_same_ids(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, results = written(tmp_path), tmp_path / "results"
    launched(spec, results)
    for name in [name for name in sys.modules if name.startswith("own_")]:
        monkeypatch.delitem(sys.modules, name)  # others may still compile its functions
    _loaded.cache_clear()
    assert relaunch(spec, results).statuses.total() == 0
