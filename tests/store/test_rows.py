"""What the columns of stored tables say of themselves."""

from pathlib import Path

import pyarrow.parquet as pq

from kernels.models import MODELS
from kernels.settings import UNITS
from tests.studies import launched

ROBOTS = """
study: robots
model: rustamani2024
preset: as_run
fixed: {n: 3, steps: 2, map: empty, width: 12, height: 8, pixel: 0.5}
seeds: [1]
seed: 1
record: {metrics: [speed], heatmaps: true}
"""


def test_a_heatmap_has_rows_and_columns_of_pixels_whatever_the_unit_of_length(
    tmp_path: Path,
) -> None:
    """A world of 12 m x 8 m has 16 rows of 24 pixels: neither metres nor px."""
    assert MODELS["rustamani2024"].length == "m"
    study = launched(ROBOTS, tmp_path)
    assert study.heatmaps["visits"][0].shape == (16, 24)
    [part] = study.store.all_parts()
    schema = pq.read_schema(part / "heatmaps.parquet")
    units = {schema.field(name).metadata[b"unit"] for name in ("rows", "columns")}
    assert units == {b"pixels"}
    assert "pixels" in UNITS
