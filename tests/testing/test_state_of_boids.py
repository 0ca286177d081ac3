"""A model whose boids have state and kinds keeps the promises, also when boids are
sorted otherwise within their kinds.
"""

from pathlib import Path

import pytest

from sweep.testing import PROMISES, assert_keeps
from tests import ROOT
from tests.cases import slow_but
from tests.interpreter import interpreted

TEXT = (ROOT / "tests" / "oscillators.py").read_text()
COUNTS = "    count_kinds=count_kinds,\n"
DECLARED = '    symmetries={"translation": {}, "permutation": {"jitter": 0.0}},\n'
FLOWN = ("calls", "restart", "symmetries", "reach")
"""Promises that are tried in short flights, in the fast suite where nothing is
compiled.
"""
COMPILED = (*FLOWN, "grid", "allocation", "interpreter", "workers")
"""Promises for which the model is compiled here."""


@pytest.fixture(scope="module")
def circles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the model, which is compiled once for all promises."""
    path = tmp_path_factory.mktemp("circles") / "circles.py"
    text = TEXT.replace(COUNTS, COUNTS + DECLARED)
    path.write_text(f'{text}\nMETRICS = {{"order": ORDER}}\n')
    return path


@pytest.mark.parametrize(
    "promise", slow_but([one for one in PROMISES if one not in COMPILED], PROMISES)
)
def test_boids_with_state_and_kinds_keep_what_is_promised(
    circles: Path, promise: str
) -> None:
    assert_keeps(circles, promise)


@pytest.mark.parametrize("promise", FLOWN)
def test_they_keep_it_in_the_interpreter_too(circles: Path, promise: str) -> None:
    interpreted(
        "from sweep.testing import assert_keeps\n"
        f"assert_keeps({str(circles)!r}, {promise!r})"
    )
