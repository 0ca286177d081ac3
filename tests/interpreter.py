"""Plain Python: a process in which nothing is compiled, the reference of all bits.

Its start takes a second, so that all tests of a process share one.
"""

import atexit
import json
import os
import subprocess
import sys
from functools import cache
from typing import Any

from tests import ROOT

PROGRAM = """
import io, json, sys, traceback, warnings
from contextlib import redirect_stdout
import numba

assert numba.config.DISABLE_JIT
for line in sys.stdin:
    printed, error = io.StringIO(), ""
    try:
        with redirect_stdout(printed), warnings.catch_warnings():
            exec(json.loads(line), {"__name__": "__main__"})
    except BaseException:
        error = traceback.format_exc()
    print(json.dumps([printed.getvalue(), error]), flush=True)
"""


def interpreted(code: str) -> str:
    """What `code` prints in a process that compiles nothing, where each warning is an
    error. Modules that it imports stay for the next one; its names do not.
    """
    process = _started()
    process.stdin.write(json.dumps(code) + "\n")
    process.stdin.flush()
    answer = process.stdout.readline()
    assert answer, "the process has ended"
    printed, error = json.loads(answer)
    assert not error, error
    return str(printed)


@cache
def _started() -> Any:
    environment = {"PYTHONPATH": str(ROOT), "NUMBA_DISABLE_JIT": "1"}
    process = subprocess.Popen(
        [sys.executable, "-B", "-W", "error", "-c", PROGRAM],
        env=os.environ | environment,
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    atexit.register(process.communicate)
    return process
