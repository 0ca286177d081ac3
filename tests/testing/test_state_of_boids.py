"""A model whose boids have state and kinds keeps the promises, also when boids are
sorted otherwise within their kinds.
"""

from pathlib import Path

import pytest

from sweep.testing import PROMISES, assert_keeps
from tests import ROOT
from tests.cases import slow_but

TEXT = (ROOT / "tests" / "oscillators.py").read_text()
COUNTS = "    count_kinds=count_kinds,\n"
DECLARED = '    symmetries={"translation": {}, "permutation": {"jitter": 0.0}},\n'


@pytest.mark.parametrize(
    "promise", slow_but([one for one in PROMISES if one != "interpreter"], PROMISES)
)
def test_boids_with_state_and_kinds_keep_what_is_promised(
    tmp_path: Path, promise: str
) -> None:
    path = tmp_path / "circles.py"
    text = TEXT.replace(COUNTS, COUNTS + DECLARED)
    path.write_text(f'{text}\nMETRICS = {{"order": ORDER}}\n')
    assert_keeps(path, promise)
