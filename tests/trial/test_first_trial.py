"""What a worker imports before its first trial: little, as workers begin often."""

import pickle

from kernels.models import MODELS
from sweep.trial.simulation import run
from tests import builders
from tests.commands import python

HEAVY = {
    "joblib",
    "matplotlib",
    "numba.np.arraymath",
    "numba.np.npyimpl",
    "optuna",
    "pandas",
    "pyarrow",
    "scipy.linalg",
    "scipy.stats",
    "sweep.store.store",
}
"""Tables, figures, searches, analyses, and what numba compiles with."""
FIRST = """
import pickle, sys
import sweep.workers.checkpoint, sweep.workers.worker
from kernels.stamps import code_stamp
from sweep.trial.simulation import run
print(code_stamp.cache_info().currsize)
for job in pickle.loads(bytes.fromhex("{jobs}")):
    result = run(job)
    print(result.status, result.last["speed"].hex())
print(*sys.modules)
"""


def test_a_worker_imports_no_tables_and_nothing_that_compiles() -> None:
    """Whatever the model and its metrics are. And it takes no source apart before it
    calls a kernel.
    """
    jobs = [
        builders.job(model, metrics=_recorded(model), n=7, steps=3) for model in MODELS
    ]
    there = [run(job) for job in jobs]  # it compiles, where nobody has yet
    assert {one.status for one in there} == {"done"}
    said = python(FIRST.format(jobs=pickle.dumps(jobs).hex())).splitlines()
    stamps, *trials, modules = said
    assert trials == [f"done {one.last['speed'].hex()}" for one in there]
    assert HEAVY & set(modules.split()) == set()
    assert "numba.core.dispatcher" in modules.split()
    assert stamps == "0"


def _recorded(model: str) -> tuple[str, ...]:
    """The metrics that are recorded of a model, and its speed."""
    return tuple({**dict.fromkeys(MODELS[model].metrics), "speed": None})
