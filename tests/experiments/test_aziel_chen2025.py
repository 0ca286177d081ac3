"""What the figures of aziel_chen2025 show of its claims."""

from collections.abc import Iterator
from functools import cache

import pytest
from matplotlib.figure import Figure

from experiments.aziel_chen2025 import figures
from sweep.published.verdicts import Region


@pytest.fixture(scope="module", autouse=True)
def read_once() -> Iterator[None]:
    """Each row of a table asks for the claims, and their file is long."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "shown", cache(figures.shown))
        yield


@pytest.mark.parametrize("column", figures.COLUMNS)
@pytest.mark.parametrize("spec", figures.OURS)
def test_a_band_is_about_the_published_number(spec: str, column: str) -> None:
    """The steps of `fitted_steps` were fitted to the coverage, those of `visit_steps`
    to the mean visits, so these test the other number; `equal_steps` tests both.
    """
    found = {
        row: figures._allowed(spec, column, *row)
        for row in figures.TABLE_1
        if figures._has(spec, row[0])
    }
    counts = {len(regions) for regions in found.values()}
    tested = (spec, column) != ("visit_steps", "coverage_total")
    assert counts <= {0, 1}
    assert (counts != {0}) == tested
    for row, regions in found.items():
        published = getattr(figures.TABLE_1[row], column)
        for allowed in regions:
            assert (allowed.least + allowed.most) / 2.0 == pytest.approx(published)
            assert 0.0 < allowed.half_width < 0.06 * published


def test_a_band_and_a_shade_lie_where_claims_allow() -> None:
    axes = Figure().subplots()
    figures._band(axes, 2.0, Region(0.4, 0.5), "black")
    (bar,) = axes.patches
    assert bar.get_bbox().intervalx == pytest.approx([0.4, 0.5])
    for column, ends in (("coverage_total", (0.0, 5.0)), ("coverage_cv", (-4.0, 0.0))):
        axes = Figure().subplots()
        axes.set_xlim(-4.0, 5.0)
        figures._shade_expected(axes, column)
        (shade,) = axes.patches
        assert shade.get_extents().transformed(
            axes.transData.inverted()
        ).intervalx == pytest.approx(ends)
        assert axes.get_xlim() == (-4.0, 5.0)
