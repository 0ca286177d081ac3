"""A search in a storage of optuna: its best trial is our winner, and nothing there is
written over.
"""

import warnings
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import optuna
import pytest

from sweep.errors import OutputError
from sweep.methods.search import exporting as module
from sweep.methods.search.exporting import check_export, export
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from tests.made_up_searches import GAIN, MEAN, MadeUp, rows, searched

LOSS = Objective("loss", False, MEAN)
RANGES = {
    "weight": {"loguniform": [0.001, 1.0]},
    "n": {"integers": [1, 9]},
    "kind": {"choice": ["a", "b", True]},
}
HITS = Constraint("hits", 1.0, True, Statistic("worst"))


@pytest.fixture(autouse=True)
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        yield


def stored(monkeypatch: pytest.MonkeyPatch, asked: MadeUp) -> Any:
    about = asked.description | {"parameters": list(RANGES), "ranges": RANGES}
    monkeypatch.setattr(
        module,
        "read_asked",
        lambda _study: MadeUp(asked.table, about, asked.distributions),
    )
    return SimpleNamespace(name="my/gains", spec="study: my/gains")


def candidate(number: int, values: list[float], **more: Any):
    columns = {
        "gain": np.array(values)[:, None],
        "hits": 0.0,
        "weight": 0.01 * (number + 1),
        "n": 1 + number % 9,
    }
    return rows(
        "search",
        "search",
        number,
        columns | {"kind": "ab"[number % 2]} | more,
        batch=number // 12,
    )


def some_search() -> MadeUp:
    parts = [candidate(k, [float(k % 7), float(k % 7) + 2.0]) for k in range(20)]
    parts.append(candidate(20, [50.0]))
    parts.append(candidate(21, [60.0, 60.0], hits=np.array([[3.0], [0.0]])))
    parts.append(candidate(22, [70.0], status=np.array([["failed"]])))
    parts.append(candidate(6, [5.5, 6.5, 7.5]).assign(phase="held_out"))
    return searched(*parts, constraints=(HITS,), full=2)


def test_optuna_finds_our_winner_and_can_work_with_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"sqlite:///{tmp_path}/gains.db"
    assert export(stored(monkeypatch, some_search()), url) == "my/gains"
    study = optuna.load_study(study_name="my/gains", storage=url)
    best = study.best_trial
    assert best.user_attrs["candidate"] == 6
    assert best.value == 7.0
    assert best.params == {"weight": pytest.approx(0.07), "n": 7, "kind": "a"}
    assert best.user_attrs["held_out"] == {"gain": 6.5}
    assert best.user_attrs["trial_ids"] == [
        "search-search-6-0-0",
        "search-search-6-1-0",
    ]
    assert best.intermediate_values == {0: 6.0, 1: 7.0}
    assert best.distributions["weight"].log
    assert set(optuna.importance.get_param_importances(study)) == set(RANGES)
    assert study.metric_names == ["gain"]
    assert study.user_attrs["boidsweep"]["spec"] == "study: my/gains"
    study._storage._backend.engine.dispose()


def test_what_was_raced_out_is_pruned_what_failed_has_failed_and_constraints_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = f"sqlite:///{tmp_path}/gains.db"
    export(stored(monkeypatch, some_search()), url)
    study = optuna.load_study(study_name="my/gains", storage=url)
    raced_out, infeasible, failed = study.trials[20:23]
    assert raced_out.state == optuna.trial.TrialState.PRUNED
    assert raced_out.user_attrs["status"] == "raced out"
    assert raced_out.value == 50.0
    assert infeasible.state == optuna.trial.TrialState.COMPLETE
    assert infeasible.constraints == {"hits worst": 2.0}
    assert failed.state == optuna.trial.TrialState.FAIL
    study._storage._backend.engine.dispose()


def test_several_objectives_have_best_trials(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = [(1.0, 1.0), (3.0, 3.0), (2.0, 5.0)]
    parts = [candidate(k, [gain], loss=loss) for k, (gain, loss) in enumerate(points)]
    url = f"sqlite:///{tmp_path}/front.db"
    export(
        stored(monkeypatch, searched(*parts, objectives=(GAIN, LOSS), full=1)),
        url,
        "other",
    )
    study = optuna.load_study(study_name="other", storage=url)
    assert sorted(trial.user_attrs["candidate"] for trial in study.best_trials) == [
        0,
        1,
    ]
    assert [direction.name for direction in study.directions] == [
        "MAXIMIZE",
        "MINIMIZE",
    ]
    study._storage._backend.engine.dispose()


def test_a_study_that_is_there_is_left_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, study = f"sqlite:///{tmp_path}/gains.db", stored(monkeypatch, some_search())
    check_export(url, "my/gains")
    export(study, url)
    for again in (lambda: export(study, url), lambda: check_export(url, "my/gains")):
        with pytest.raises(
            OutputError,
            match=(
                r'already has a study "my/gains", which stays unchanged; give'
                r" another URL"
            ),
        ):
            again()
    assert export(study, url, "again") == "again"
    loaded = optuna.load_study(study_name="my/gains", storage=url)
    assert len(loaded.trials) == 23
    loaded._storage._backend.engine.dispose()


def test_an_export_that_breaks_off_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    url, study = f"sqlite:///{tmp_path}/gains.db", stored(monkeypatch, some_search())

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(optuna.Study, "add_trials", interrupted)
        with pytest.raises(KeyboardInterrupt):
            export(study, url)
    assert export(study, url) == "my/gains"


@pytest.mark.parametrize(
    "url",
    [
        "gains.db",
        "squelite:///gains.db",
        "sqlite:////no/such/folder/gains.db",
        "redis://host",
        "sqlite://gains.db",
    ],
)
def test_a_url_that_is_none_is_one_line(
    url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = stored(monkeypatch, some_search())
    for attempt in (lambda: export(study, url), lambda: check_export(url, "my/gains")):
        with pytest.raises(OutputError) as caught:
            attempt()
        assert str(caught.value).startswith(f"{url}: ")
        assert "sqlite:///gains.db" in str(caught.value)
        assert "\n" not in str(caught.value)
