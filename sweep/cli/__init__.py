"""The command line. Data goes to stdout, progress and messages to stderr.

Exit codes: 0 fine, 1 some trials did not come to their end, 2 wrong usage or a bad
spec, 130 interrupted by Ctrl-C, SIGTERM or SIGHUP. Everything heavy is imported inside
the commands, so that `sweep --help` answers at once.

    app              the app and its options
    engines          where trials run
    running          launch, search, reproduce
    reading          table, plot, compare
    keeping          verify, diff, gc, export
    viewing          the live simulator
    catalogue        models, maps, metrics
    listing          what exists, what came out
    progress         a launch on stderr
    search_progress  a search on stderr
    counting         other work on stderr
    search_report    what a search found
    showing          files of a replay
    comparison_text  a comparison
    output           standard output that cannot be written
    terminal         tables and lines, by rich
"""

# ruff: isort: off
# The modules enter their commands in the order of the help.
from sweep.cli import running as running
from sweep.cli import reading as reading
from sweep.cli import keeping as keeping
from sweep.cli import viewing as viewing
from sweep.cli import catalogue as catalogue

# ruff: isort: on
from sweep.cli.app import app, stop
from sweep.cli.output import check_output_stream, flush_output
from sweep.errors import UserError
from sweep.text import guard_streams
from sweep.workers.surroundings import ignore_settings

INTERRUPTED = 130


def main() -> None:
    """The `sweep` command: errors that a user can mend become one line and an exit
    code.
    """
    ignore_settings()
    check_output_stream()
    guard_streams()
    try:
        try:
            app()
        finally:
            flush_output()
    except (KeyboardInterrupt, SystemExit) as ending:
        # typer turns Ctrl-C into an exit without a word.
        if isinstance(ending, SystemExit) and ending.code != INTERRUPTED:
            raise
        stop(
            "interrupted; what is done is stored,"
            " and the same command goes on from there",
            INTERRUPTED,
        )
    except BrokenPipeError:
        pass  # the reader of our output has seen enough
    except UserError as error:
        stop(str(error), error.exit_code)
