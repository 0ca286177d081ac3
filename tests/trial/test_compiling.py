"""That something will be compiled is said before: in a plan, and where trials run."""

import logging

import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.campaigns import plan as planning
from sweep.campaigns.plan import plan_of
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.trial import simulation
from sweep.trial.simulation import compiling_seconds, warm
from sweep.web.compiling import prepare
from tests.commands import python
from tests.studies import OWN_SMALL, SMALL, read


def test_it_is_said_before_a_model_is_compiled_and_not_afterwards(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    study = read(SMALL)
    job = Jobs(study, expand(study))[0]
    warm(job)
    assert compiling_seconds(MODELS[job.model]) == 0.0
    caplog.clear()
    warm(job)
    assert caplog.messages == []
    monkeypatch.setattr(simulation, "is_kept", lambda _function: False)
    with caplog.at_level(logging.WARNING, "sweep"):
        warm(job)
    said = f"compiling {job.model}, about 15 s on an idle core, once"
    assert caplog.messages == [said]


def test_it_is_said_too_where_an_own_model_is_tried_and_where_one_is_shown(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Both compile before a launch, or the page, would say so."""
    monkeypatch.setattr(simulation, "is_kept", lambda _function: False)
    plan_of(read(OWN_SMALL), 2)
    assert {one.split(",")[0] for one in caplog.messages} == {"compiling drawn"}
    caplog.clear()
    prepare.__wrapped__("nguyen2024", "as_run", BUILT_IN)
    assert [one.split(",")[0] for one in caplog.messages] == ["compiling nguyen2024"]


def test_a_plan_has_the_time_where_the_model_is_not_compiled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    study = read(SMALL)
    warm(Jobs(study, expand(study))[0])
    assert "to compile the model" not in plan_of(study, 2).as_text()
    monkeypatch.setattr(planning, "compiling_seconds", lambda _model, _threads: 15.0)
    plan = plan_of(study, 2)
    assert plan.compiling_seconds == 15.0
    assert "workers, and once about 15.0 s to compile the model" in plan.as_text()


CODE = """
from kernels.caching import is_kept
from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
print([is_kept(model.advance) for model in MODELS.values()])
"""


def test_an_empty_cache_keeps_no_model(tmp_path: object) -> None:
    kept = python(CODE, NUMBA_CACHE_DIR=str(tmp_path), NUMBA_DISABLE_JIT="0")
    assert kept.strip() == str([False] * len(list(MODELS)))
