"""The command line. Data goes to stdout, progress and messages to stderr.

Exit codes: 0 fine, 1 some trials did not come to their end, 2 wrong usage or a bad spec, 130 interrupted by
Ctrl-C, SIGTERM or SIGHUP.
Everything heavy is imported inside the commands, so that `sweep --help` answers at once.
"""

import os
import sys

from sweep.cli import running, reading, keeping, viewing, catalogue  # noqa: F401  # isort: skip (entered in the order of the help)
from sweep.cli.app import app, stop
from sweep.harmless import guard_streams
from sweep.surroundings import ignore_settings

INTERRUPTED = 130
ENDINGS = {
    "SpecError": 2,
    "StoreError": 2,
    "UnreachableError": 2,
    "WorkersError": 2,
    "CacheError": 2,
    "ShareError": 2,
    "FailedTrialsError": 1,
}
"""The exit codes of errors that a user can mend, by name: importing them would take a while."""


def main() -> None:
    """The `sweep` command: errors that a user can mend become one line and an exit code."""
    ignore_settings()
    guard_streams()
    try:
        app()
    except (KeyboardInterrupt, SystemExit) as ending:
        # typer turns Ctrl-C into an exit without a word.
        if isinstance(ending, SystemExit) and ending.code != INTERRUPTED:
            raise
        stop("interrupted; what is done is stored, and the same command goes on from there", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has seen enough; Python would complain once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as error:
        code = ENDINGS.get(type(error).__name__)
        if code is None:
            raise
        stop(str(error), code)
