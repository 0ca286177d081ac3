"""A report: the answer to one question about a study, for a reader and for a program.

A report is made once, so all forms agree. CSV, JSON and LaTeX are made here, text for a
terminal in `sweep.cli.reporting`. The explorer shows the tables.
"""

import json
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from sweep.tables.safe_csv import as_csv

MAX_ROWS = 200
"""Maximum number of rows for a reader; CSV and JSON have all."""
LATEX_SIGNS = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
} | {sign: f"\\{sign}" for sign in "&%$#_{}"}
"""ASCII characters that LaTeX would interpret or replace."""


@dataclass(frozen=True)
class TextTable:
    """A table of strings for a reader.

    Attributes
    ----------
    columns : sequence of str
        The headings. A line break in a heading is preserved in a terminal.
    rows : sequence of sequence of str
        The cells: for each row one string per column.
    title : str
        Text above the table.
    caption : str
        Lines below the table, an explanation.
    right : collection of str
        Headings of the columns that are set flush right.
    sections : collection of int
        Numbers of the rows that begin a new section.
    ruled : bool
        Whether columns are separated by lines. A table without lines is narrower.
    hidden : int
        Number of further rows.
    row_name : str
        Noun for a row in the line about hidden rows.
    """

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    caption: str = ""
    right: Collection[str] = ()
    sections: Collection[int] = ()
    ruled: bool = True
    hidden: int = 0
    row_name: str = "row"

    @property
    def about_hidden(self) -> str:
        """The line about hidden rows; "" if all are shown."""
        if not self.hidden:
            return ""
        return f"{self.hidden:,} more {self.row_name}s: --csv and --json give all"


@dataclass(frozen=True)
class Report:
    """The answer to one question about a study.

    Attributes
    ----------
    rows : DataFrame
        One row per finding, with all digits: the CSV.
    facts : object
        All results, as values of JSON.
    parts : sequence of TextTable and str
        The form for a reader: tables, and lines of text between tables.
    """

    rows: pd.DataFrame
    facts: Any
    parts: Sequence[TextTable | str]

    def to_csv(self) -> str:
        """Return the rows as CSV, in which no string is a formula of a spreadsheet."""
        return as_csv(self.rows)

    def to_json(self) -> str:
        """Return the facts as JSON. Floats that are read from the JSON are equal."""
        return json.dumps(self.facts, indent=2, allow_nan=False) + "\n"

    def to_latex(self) -> str:
        """Return the tables as LaTeX, which needs the package booktabs.

        Lines of text and captions are comments.
        """
        lines = list[str]()
        for part in self.parts:
            if isinstance(part, TextTable):
                lines += _latex_table(part)
            else:
                lines += _latex_comment(part)
        return "\n".join(lines) + "\n"


def _latex_table(table: TextTable) -> list[str]:
    alignment = "".join("r" if name in table.right else "l" for name in table.columns)
    heads = [_latex(name.replace("\n", " ")) for name in table.columns]
    lines = [r"\begin{table}", r"\centering"]
    if table.title:
        lines.append(rf"\caption{{{_latex(table.title)}}}")
    lines += [rf"\begin{{tabular}}{{{alignment}}}", r"\toprule", _latex_row(heads)]
    lines.append(r"\midrule")
    for number, row in enumerate(table.rows):
        if number and number in table.sections:
            lines.append(r"\midrule")
        lines.append(_latex_row([_latex(cell) for cell in row]))
    lines += [r"\bottomrule", r"\end{tabular}", r"\end{table}"]
    lines += _latex_comment(table.caption)
    lines += _latex_comment(table.about_hidden)
    return lines


def _latex_row(cells: Sequence[str]) -> str:
    return rf"{' & '.join(cells)} \\"


def _latex_comment(text: str) -> list[str]:
    return [f"% {line}" for line in text.splitlines() if line]


def _latex(text: str) -> str:
    """Return a string whose special characters LaTeX prints."""
    shown = " ".join(text.split())
    return re.sub(r"[\\~^<>&%$#_{}]", lambda sign: LATEX_SIGNS[sign[0]], shown)
