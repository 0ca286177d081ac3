"""Explorers that are killed while a study is launched.

A process that has loaded the explorer once becomes another one for each: it forks, and
the new process serves a page as `sweep show` does.
"""

import os
import subprocess
import sys
from pathlib import Path

from sweep.explorer.site import explorer
from tests import ROOT


def main() -> None:
    """For each line that comes, an explorer of this folder of results and study; its
    process and the address of its page are printed.
    """
    for line in sys.stdin:
        results, study = line.split()
        page = os.fork()
        if page:
            os.waitpid(page, 0)
            print("gone", flush=True)
            continue
        server, _ = explorer(Path(results), study)
        print(os.getpid(), server.url, flush=True)
        server.run()
        os._exit(0)


def nursery() -> "subprocess.Popen[str]":
    """The process that becomes explorers."""
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "tests.faults.shows"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        cwd=ROOT,
    )


if __name__ == "__main__":
    main()
