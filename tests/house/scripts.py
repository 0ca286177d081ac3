"""What the linter and the formatter of scripts do not see."""

from collections.abc import Iterator

from tests.house.sources import Checkout, Finding

MOST_SIGNS = 88


def lines_of_scripts_are_short(checkout: Checkout) -> Iterator[Finding]:
    """The formatter breaks code, but neither comments nor texts."""
    for name in checkout.files("sweep/**/*.[jt]s", "tests/**/*.[jt]s"):
        for number, line in enumerate(checkout.document(name).text.splitlines(), 1):
            if len(line) > MOST_SIGNS:
                yield Finding(name, number, f"a line of {len(line)} signs")


RULES = (lines_of_scripts_are_short,)
