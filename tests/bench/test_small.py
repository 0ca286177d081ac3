"""Every benchmark runs to its end with few steps, sizes and rounds. That of a GPU has a
small mode of its own, see test_device.
"""

import pytest

from tests.bench.__main__ import ALL
from tests.bench.scale import SMALL


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in ALL if name != "device"])
def test_it_runs_to_its_end(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    ALL[name](SMALL)
    said = capsys.readouterr().out
    assert said
    if all("skipped" in line for line in said.splitlines()):
        pytest.skip(said.strip())
