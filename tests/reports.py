"""Reports as a reader of a terminal, or of a pipe, gets them."""

from contextlib import redirect_stdout
from io import StringIO

from sweep.cli.reporting import print_report
from sweep.tables import Report


def as_text(report: Report) -> str:
    with redirect_stdout(StringIO()) as text:
        print_report(report)
    return text.getvalue()
