"""The command line. Data goes to stdout; progress and messages go to stderr.

Exit codes: 0 fine, 1 some trials are not done or differ, 2 wrong usage or a bad spec,
130 interrupted by Ctrl-C, SIGTERM or SIGHUP. Each command imports heavy modules itself,
so that `sweep --help` answers at once.

    app              the app, and options that commands share
    engines          the options that choose where trials run
    starting         init, new: a new study, and custom code

    running          launch, search, plan, reproduce
    measuring        measure: further metrics of stored trials
    warming          warm: compiles ahead
    checking         check: the requirements of a model

    reading          status, table, power, boundary, hysteresis, resilience,
                     scaling, plot, compare, validity
    reporting        commands that print a report
    overview         list, columns: stored studies and columns

    maintenance      replay, verify, diff, gc, rename, rm, export,
                     flocks
    sharing          pack, load, cite, odd: a study for other people

    own_code         code: custom code of a stored study
    viewing          view: the live simulator

    showing          show: the results explorer, or a study as one file
    supplementing    the options of the file of a study
    page_beside      the explorer next to a launch

    guide            guide: the documentation, in the terminal
    catalogue        models, maps, metrics, schema
    listing          tables of models, maps, metrics and stored trials

    progress         the progress of a launch, on stderr
    progress_line    the progress of further work, on stderr
    replay_files     the files that a replay writes
    completing       names that a shell completes

    spec_files       the file of a spec that a command names, or of a stored study
    topics           the guide by topics

    output           errors of standard output
    terminal         tables and lines, by rich
"""

# ruff: isort: off
# The modules enter the commands of each group in the order of the help.
from sweep.cli import starting as starting
from sweep.cli import running as running
from sweep.cli import reading as reading
from sweep.cli import overview as overview
from sweep.cli import measuring as measuring
from sweep.cli import maintenance as maintenance
from sweep.cli import sharing as sharing
from sweep.cli import own_code as own_code
from sweep.cli import viewing as viewing
from sweep.cli import showing as showing
from sweep.cli import warming as warming
from sweep.cli import guide as guide
from sweep.cli import checking as checking
from sweep.cli import catalogue as catalogue

# ruff: isort: on
from sweep.cli.app import app, stop
from sweep.cli.output import check_output_stream, flush_output
from sweep.cli.reporting import enter_reports_of_packages
from sweep.errors import UserError
from sweep.surroundings import SETTINGS, ignore_settings
from sweep.text import guard_streams

INTERRUPTED = 130


def main() -> None:
    """Run the `sweep` command.

    An error that a user can fix becomes one line on stderr and an exit code.
    """
    ignore_settings(*SETTINGS)
    check_output_stream()
    guard_streams()
    try:
        try:
            enter_reports_of_packages()
            app()
        finally:
            flush_output()
    except (KeyboardInterrupt, SystemExit) as ending:
        # typer turns Ctrl-C into an exit without a message.
        if isinstance(ending, SystemExit) and ending.code != INTERRUPTED:
            raise
        stop(
            "interrupted; finished trials are stored,"
            " and the same command resumes the run",
            INTERRUPTED,
        )
    except BrokenPipeError:
        pass  # the reader of the output has closed the pipe
    except UserError as error:
        stop(str(error), error.exit_code)
