"""Every benchmark runs to its end with few steps, sizes and rounds. That of a GPU has a
small mode of its own, see test_device.

They run in a thread of their own: a thread can have one Playwright, and that of the
tests may have begun one for other pages.
"""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.bench.__main__ import ALL
from tests.bench.scale import SMALL


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in ALL if name != "device"])
def test_it_runs_to_its_end(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with ThreadPoolExecutor(max_workers=1) as pool:
        pool.submit(ALL[name], SMALL).result()
    said = capsys.readouterr().out
    assert said
    if all("skipped" in line for line in said.splitlines()):
        pytest.skip(said.strip())
