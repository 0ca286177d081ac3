"""CSV files that a spreadsheet opens: a text in them never becomes a formula.

A spreadsheet takes a cell that begins with = + - or @ for a formula, whether it is
quoted or not (OWASP, CSV injection). So such a text gets an apostrophe before it, and
so does a text that has one there already: whoever takes one leading apostrophe away has
every text as it was. Numbers are written as they are.
"""

import re

import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc

FORMULA = "^(['\" \\t\\r\\n]*[=+\\-@\uff1d\uff0b\uff0d\uff20]|['\\t\\r\\n])"
"""How a text begins that needs an apostrophe; some languages read wide signs so."""


def without_formulas(table: pa.Table) -> pa.Table:
    """`table` with texts, those of its heading too, that no spreadsheet computes."""
    columns = [_defused(column) for column in table.columns]
    return pa.table(columns, names=[_text(name) for name in table.column_names])


def as_csv(frame: pd.DataFrame) -> str:
    """The CSV of a table without its index, of which no spreadsheet computes a text."""
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
