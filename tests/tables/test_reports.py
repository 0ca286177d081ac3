"""A report as CSV, JSON and LaTeX, and as a reader sees it."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.cli.app import app
from sweep.cli.reporting import FORMATS, print_report
from sweep.tables.reports import LATEX_SIGNS, Report, TextTable
from sweep.text import description_of
from tests.commands import sweep
from tests.studies import SMALL, launched

SIGNS = "".join(LATEX_SIGNS)
TABLE = TextTable(
    columns=["metric", "speed\n(m/s)", "5 %"],
    rows=[["a_b & c", "1.5 ± 0.2", "<0.001"], ["", "2", "-"], ["d", "3", "4"]],
    title="study/one_two",
    caption="how to read it\nand more",
    right=["5 %"],
    sections={0, 2},
    hidden=1234,
    row_name="point",
)
REPORT = Report(
    rows=pd.DataFrame({"metric": ["=speed"], "mean": [0.1 + 0.2]}),
    facts={"mean": 0.1 + 0.2},
    parts=["A against B", TABLE, ""],
)


def test_latex_has_the_cells_and_says_what_it_leaves_out() -> None:
    assert (
        REPORT.to_latex()
        == r"""% A against B
\begin{table}
\centering
\caption{study/one\_two}
\begin{tabular}{llr}
\toprule
metric & speed (m/s) & 5 \% \\
\midrule
a\_b \& c & 1.5 ± 0.2 & \textless{}0.001 \\
 & 2 & - \\
\midrule
d & 3 & 4 \\
\bottomrule
\end{tabular}
\end{table}
% how to read it
% and more
% 1,234 more points: --csv and --json give all
"""
    )


def test_latex_obeys_no_sign_of_a_text() -> None:
    table = TextTable(columns=["x"], rows=[[f"a{SIGNS}b"]])
    lines = Report(pd.DataFrame(), {}, [table]).to_latex().splitlines()
    [cell] = [line for line in lines if line.startswith("a")]
    obeyed = re.sub(r"\\text\w+\{\}|\\[&%$#_{}]", "", cell)
    assert obeyed == r"ab \\"


def test_csv_and_json_have_all_digits_and_no_formula() -> None:
    assert REPORT.to_csv() == "metric,mean\n'=speed,0.30000000000000004\n"
    assert json.loads(REPORT.to_json()) == {"mean": 0.1 + 0.2}
    with pytest.raises(ValueError, match="JSON"):
        Report(pd.DataFrame(), {"mean": np.nan}, []).to_json()


def test_a_reader_sees_tables_and_lines_in_their_order(
    capsys: pytest.CaptureFixture[str],
) -> None:
    print_report(REPORT)
    shown = capsys.readouterr().out
    places = [
        shown.index(words)
        for words in ("A against B", "study/one_two", "a_b & c", "how to", "1,234 more")
    ]
    assert places == sorted(places)
    assert "speed\n(m/s)" not in shown  # both lines of a heading stand in its column
    assert shown.endswith("\n\n")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reports")
    launched(SMALL, folder)
    return folder


def test_a_table_of_a_study_is_printed_for_latex(results: Path) -> None:
    done = sweep(results, "table", "small", "--latex", "--results", ".")
    assert done.returncode == 0
    assert r"\begin{tabular}" in done.stdout
    assert "separation\\_weight" in done.stdout


def test_two_formats_are_refused(results: Path) -> None:
    done = sweep(results, "table", "small", "--latex", "--csv", "--results", ".")
    assert done.returncode == 2
    assert done.stderr == "--csv and --latex are two formats: choose one\n"


def test_every_report_has_every_format() -> None:
    options = [
        command.callback.__annotations__.keys()
        for command in app.registered_commands
        if command.callback and "csv" in command.callback.__annotations__
    ]
    assert len(options) >= 8
    assert all(FORMATS.keys() <= names for names in options)


def test_the_help_of_a_report_ends_before_the_sections_of_its_docstring() -> None:
    def spread(study: object, metric: str = "speed") -> Report:
        """Print the spread of a metric.

        It is a range.

        Parameters
        ----------
        study : StoredStudy
        """
        raise NotImplementedError

    assert description_of(spread) == "Print the spread of a metric.\n\nIt is a range."
