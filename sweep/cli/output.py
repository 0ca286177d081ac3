"""Standard output that fails with an error for the user, and in no other way.

A full disk behind `sweep table STUDY > FILE` is found when Python empties the buffer of
the stream: while something is printed, or at the very end. Both happen before `main` is
over, because it flushes the stream itself.

Signs that the encoding of the stream does not have are spelled in ASCII.
"""

import codecs
import io
import os
import sys
from contextlib import suppress
from typing import Any, NoReturn, TextIO

from sweep.errors import OutputError


class Output:
    """A text stream that writes to `stream`. Raises OutputError where that fails, and
    BrokenPipeError where the reader of a pipe has gone.

    After the first failure the descriptor of the stream leads to nowhere: what is left
    in the buffer would fail again when the interpreter ends.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write `text`; the number of its characters."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._fail(error)

    def flush(self) -> None:
        """Write what is still in the buffer."""
        try:
            self._stream.flush()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        with suppress(OSError):  # a stream of a test has no descriptor
            os.dup2(os.open(os.devnull, os.O_WRONLY), self._stream.fileno())
        if isinstance(error, BrokenPipeError):
            raise error
        raise OutputError(
            f"standard output cannot be written ({error.strerror or error});"
            " send it to another file or disk"
        ) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


SPELLED = "boidsweep.spelled"
IN_ASCII = {"±": "+-", "²": "^2"}
"""Signs of numbers and units; all others are escaped."""


def spelled(text: str, encoding: str) -> str:
    """`text` without the signs that an encoding does not have."""
    return text.encode(encoding, SPELLED).decode(encoding)


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    """What is written for the signs of an error, and where writing goes on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    if sign := IN_ASCII.get(error.object[error.start]):
        return sign, error.start + 1
    return codecs.backslashreplace_errors(error)


codecs.register_error(SPELLED, _spell)


def check_output_stream() -> None:
    """From now on standard output fails as `Output` says, and no sign makes it fail."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors=SPELLED)
    if sys.stdout is not None:  # it is None where it is closed
        sys.stdout = Output(sys.stdout)


def flush_output() -> None:
    """Write what is still in the buffer of standard output. Raises as `Output`."""
    if sys.stdout is not None:
        sys.stdout.flush()
