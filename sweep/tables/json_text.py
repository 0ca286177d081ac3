"""The rows of a table as JSON, with as many digits as a float needs.

pandas writes 10 decimals by default and 15 at most, so that 1e-16 becomes 0.
"""

import json
import math
from typing import Any

import pandas as pd


def json_rows(frame: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a mapping per row, without the index.

    A value that is missing or not finite is None.
    """
    if not len(frame.columns):
        return [{} for _ in range(len(frame))]
    columns = [map(_known, frame[name].tolist()) for name in frame]
    names = [str(name) for name in frame]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def rows_as_json(frame: pd.DataFrame) -> str:
    """Return the rows as JSON. Floats read from it equal the floats of the table."""
    return json.dumps(json_rows(frame), indent=2, allow_nan=False)


def _known(value: Any) -> Any:
    unknown = isinstance(value, float) and not math.isfinite(value)
    return None if value is pd.NA or unknown else value
