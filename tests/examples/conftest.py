"""The examples, entered as if they were ours."""

from collections.abc import Iterator
from importlib.util import module_from_spec, spec_from_file_location
from typing import Any

import pytest

from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.spec.settings import settings_of
from tests.examples.flown import EXAMPLES


def loaded(name: str) -> Any:
    spec = spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = module_from_spec(spec)
    import sys

    sys.modules[f"example_{name}"] = module
    spec.loader.exec_module(module)
    return module


LOADED = {n: loaded(n) for n in ("vicsek", "vortex", "rotation")}


@pytest.fixture(autouse=True)
def entered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name, module in LOADED.items():
        if hasattr(module, "MODEL"):
            monkeypatch.setitem(MODELS, name, module.MODEL)
        for metric, entry in getattr(module, "METRICS", {}).items():
            monkeypatch.setitem(METRICS, metric, entry)
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()
