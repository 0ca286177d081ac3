"""The examples, entered as if they were ours."""

from collections.abc import Iterator

import pytest

from examples import (
    phase_order,
    predator_distance,
    predators,
    rotation,
    swarmalators,
    vicsek,
    vortex,
)
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.spec.settings import settings_of

LOADED = (
    vicsek,
    vortex,
    rotation,
    phase_order,
    predator_distance,
    predators,
    swarmalators,
)


@pytest.fixture(autouse=True)
def entered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for module in LOADED:
        if hasattr(module, "MODEL"):
            monkeypatch.setitem(MODELS, module.MODEL.name, module.MODEL)
        for metric, entry in getattr(module, "METRICS", {}).items():
            monkeypatch.setitem(METRICS, metric, entry)
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()
