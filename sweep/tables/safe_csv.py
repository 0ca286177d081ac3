"""CSV files for spreadsheets, without formulas.

A spreadsheet reads a cell that begins with = + - or @ as a formula, quoted or not
(OWASP, CSV injection). An apostrophe is added before such a string, and before a string
that begins with an apostrophe. The removal of a single leading apostrophe restores
every original string. Numbers do not change.
"""

import re

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

FORMULA = "^(['\" \\t\\r\\n]*[=+\\-@\uff1d\uff0b\uff0d\uff20]|['\\t\\r\\n])"
"""Beginning of a string that needs an apostrophe, also with full-width signs."""


def without_formulas(table: pa.Table) -> pa.Table:
    """Return `table` with strings, also in the heading, that are never formulas."""
    columns = [_defused(column) for column in table.columns]
    return pa.table(columns, names=[_text(name) for name in table.column_names])


def as_csv(frame: pd.DataFrame) -> str:
    """Return a table as CSV without the index, with strings that are no formulas.

    Numbers do not change.
    """
    cells = frame.select_dtypes(exclude="number").map(_text)
    return frame.assign(**cells).rename(columns=_text).to_csv(index=False)


def _text(value: object) -> object:
    return re.sub(FORMULA, r"'\1", value) if isinstance(value, str) else value


def _defused(column: pa.ChunkedArray) -> pa.ChunkedArray:
    kind = column.type
    if pa.types.is_dictionary(kind):
        return _defused(column.cast(kind.value_type))
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return pc.replace_substring_regex(column, FORMULA, r"'\1")
    return column
