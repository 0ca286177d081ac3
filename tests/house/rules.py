"""All rules, and what they find."""

from itertools import chain

from tests.house import (
    documents,
    evaluation,
    extras,
    figures,
    imports,
    kernels,
    names,
    packages,
    plain,
    prose,
    scripts,
    systems,
    writing,
)
from tests.house.sources import Checkout, Finding, Rule

SUBJECTS = (
    *(imports, kernels, names, packages, figures, scripts, documents),
    *(evaluation, extras, systems, writing, plain, prose),
)
RULES: list[Rule] = [rule for subject in SUBJECTS for rule in subject.RULES]


def findings(checkout: Checkout) -> list[Finding]:
    """Those of all rules, by file and line."""
    return sorted(set(chain.from_iterable(rule(checkout) for rule in RULES)))
