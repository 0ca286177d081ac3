"""Prints every finding of every rule, and exits with 1 if there is one."""

import gc
import sys
from itertools import chain

from tests.house import (
    documents,
    evaluation,
    figures,
    imports,
    kernels,
    names,
    packages,
    scripts,
    systems,
    writing,
)
from tests.house.sources import HERE, Checkout, Finding, Rule

SUBJECTS = (
    *(imports, kernels, names, packages, figures, scripts, documents),
    *(evaluation, systems, writing),
)
RULES: list[Rule] = [rule for subject in SUBJECTS for rule in subject.RULES]


def findings(checkout: Checkout) -> list[Finding]:
    """Those of all rules, by file and line."""
    return sorted(set(chain.from_iterable(rule(checkout) for rule in RULES)))


def main(checkout: Checkout) -> int:
    """The exit code."""
    found = findings(checkout)
    for finding in found:
        print(finding)
    return 1 if found else 0


if __name__ == "__main__":
    gc.disable()  # the trees of all modules stay until the end
    sys.exit(main(HERE))
