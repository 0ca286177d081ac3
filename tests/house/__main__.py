"""Prints every finding of every rule, and exits with 1 if there is one. What is no
Python is the only one: rules look at nothing before it is mended.
"""

import gc
import sys
from pathlib import Path

from tests import ROOT
from tests.house.sources import HERE, Checkout, Finding


def main(checkout: Checkout) -> int:
    """The exit code."""
    try:
        # Some rules import what they are about.
        from tests.house.rules import findings

        found = findings(checkout)
    except SyntaxError as error:
        found = [no_python(error)]
    for finding in found:
        print(finding)
    return 1 if found else 0


def no_python(error: SyntaxError) -> Finding:
    """Where a file is none."""
    file = Path(error.filename or "")
    name = file.relative_to(ROOT) if file.is_relative_to(ROOT) else file
    return Finding(name.as_posix(), error.lineno or 1, f"no Python: {error.msg}")


if __name__ == "__main__":
    gc.disable()  # the trees of all modules stay until the end
    sys.exit(main(HERE))
