"""Tests see nothing of the user who runs them."""

import json
import os
import subprocess
import sys
from pathlib import Path

from tests import ROOT
from tests.environment import KEPT, KEPT_PREFIXES, OWN

HOSTILE = {
    "AWS_PROFILE": "mine",
    "AWS_ENDPOINT_URL": "http://127.0.0.1:9",
    "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True",
    "GIT_DIR": "/nowhere",
    "JUPYTER_CONFIG_DIR": "/nowhere",
    "LC_ALL": "C",
    "MPLBACKEND": "no-such",
    "MPLCONFIGDIR": "/nowhere",
    "NO_COLOR": "1",
    "NUMBA_DISABLE_JIT": "1",
    "NUMBA_CACHE_DIR": "/nowhere",
    "OMP_NUM_THREADS": "7",
    "PYTHONWARNINGS": "error",
    "TZ": "Pacific/Chatham",
    "http_proxy": "http://127.0.0.1:9",
}
SCRIPT = """
import json, os, sys
sys.path.insert(0, sys.argv[1])
from tests import environment
print(json.dumps({"seen": dict(os.environ), "umask": os.umask(0)}))
"""


def test_what_a_user_has_set_is_not_seen(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(ROOT)],
        env=os.environ | HOSTILE | {"HOME": str(tmp_path), "XDG_CACHE_HOME": "/caches"},
        umask=0o077,
        capture_output=True,
        text=True,
        check=True,
    )
    said = json.loads(done.stdout)
    seen, own = said["seen"], {*OWN, "HOME", "XDG_CACHE_HOME", "LC_CTYPE"}
    assert {name for name in seen if not name.startswith(KEPT_PREFIXES)} <= {
        *KEPT,
        *own,
    }
    assert not Path(seen["HOME"]).is_relative_to(tmp_path)
    assert not Path(seen["HOME"]).exists()  # it is gone with the process
    assert (seen["XDG_CACHE_HOME"], seen["TZ"], said["umask"]) == (
        "/caches",
        "UTC",
        0o022,
    )


def test_the_tests_themselves_run_so() -> None:
    assert "boidsweep-home-" in os.environ["HOME"]
    assert os.environ.keys().isdisjoint({"http_proxy", "MPLCONFIGDIR", "GIT_DIR"})


MOST_SIGNS = 3_000_000


def test_constants_of_tests_are_small_and_name_no_home_of_one_run() -> None:
    """What is compiled of own models in `tests` is kept by the constants of all tests.
    One with the home of a run would compile it anew in each, and one of ten million
    signs costs two seconds for each kernel.
    """
    home = os.environ["HOME"]
    written = {
        f"{module} {name}": repr(value)
        for module in [one for one in sys.modules if one.partition(".")[0] == "tests"]
        for name, value in list(vars(sys.modules[module]).items())
        if not name.startswith("__") and isinstance(value, str | dict | list | tuple)
    }
    assert [name for name, said in written.items() if home in said] == []
    assert [name for name, said in written.items() if len(said) > MOST_SIGNS] == []
