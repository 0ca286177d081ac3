"""The cluster that the documentation describes gives a job script that starts one
worker of one thread on each core.
"""

import re
import shlex
import signal
from itertools import pairwise
from typing import Any

import pytest

from tests import ROOT

DOCUMENT = ROOT / "docs" / "guide" / "clusters.md"


@pytest.fixture
def snippet(monkeypatch: pytest.MonkeyPatch) -> str:
    """The Python of the documentation, which asks for no
    job and prints nothing here.
    """
    ctrl_c = signal.getsignal(signal.SIGINT)
    import dask_jobqueue as jobqueue

    signal.signal(signal.SIGINT, ctrl_c)  # which the import has made a plain exit
    monkeypatch.setattr(jobqueue.SLURMCluster, "scale", lambda *_, **__: None)
    [code] = re.findall(
        r"```python\n(from dask_jobqueue.*?)```",
        DOCUMENT.read_text(encoding="utf-8"),
        re.DOTALL,
    )
    return str(code)


def test_the_documented_cluster_asks_slurm_for_workers_of_one_thread(
    snippet: str, capsys: pytest.CaptureFixture[str]
) -> None:
    names: dict[str, Any] = {}
    exec(snippet, names)
    with names["cluster"] as cluster:
        lines = cluster.job_script().splitlines()
        address = cluster.scheduler_address
    assert capsys.readouterr().out == f"{address}\n"
    assert lines[0].startswith("#!")
    assert {
        "#SBATCH --cpus-per-task=16",
        "#SBATCH -n 1",
        "#SBATCH --mem=30G",
        "#SBATCH -t 08:00:00",
    } <= set(lines)
    assert any(
        line.startswith("export NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1")
        for line in lines
    )
    worker = shlex.split(lines[-1])
    assert worker[worker.index("distributed.cli.dask_worker") + 1] == address
    options = dict(pairwise(worker))
    assert (options["--nthreads"], options["--nworkers"]) == ("1", "16")
    assert "--nanny" in worker
