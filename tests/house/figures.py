"""Whether figures say how values are distributed."""

import ast
from collections.abc import Iterator

from tests.house.sources import Checkout, Finding

MEANS = {
    "mean_interval": "distribution",
    "curves": "distribution",
    "by_point": "distributions",
}
"""Functions that show the means of values they do not know, and what tells them how
these are distributed.
"""


def no_figure_forgets_how_values_are_distributed(
    checkout: Checkout,
) -> Iterator[Finding]:
    """`StoredStudy.means` and `mean_of` know it of metrics; of other values it is said,
    and `half_width` holds for normal ones only.
    """
    called = set()
    for name in checkout.files("sweep/figures/*.py", "experiments/*/*.py"):
        module = checkout.module(name)
        for node in module.nodes:
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                function, words = node.func.id, {one.arg for one in node.keywords}
                called.add(function)
                if function == "half_width":
                    yield module.finding(node, "half_width is for normal values only")
                if MEANS.get(function) not in {None, *words}:
                    what = f"{function} is not told the {MEANS[function]}"
                    yield module.finding(node, what)
    for function in {"mean_interval", "curves"} - called:
        yield Finding("tests/house/figures.py", 1, f"no figure calls {function}")


RULES = (no_figure_forgets_how_values_are_distributed,)
