"""Standard output whose failures are errors for the user.

A full disk behind `sweep table STUDY > FILE` is an error when Python empties the buffer
of the stream: during a print, or at the end. This happens before `main` returns,
because `main` flushes the stream.

Characters that the encoding of the stream does not have are spelled in ASCII.
"""

import codecs
import io
import os
import sys
from contextlib import suppress
from typing import Any, NoReturn, TextIO

from sweep.errors import OutputError


class Output:
    """A text stream that writes to `stream` and turns failures into errors.

    A failure raises OutputError, and a closed pipe raises BrokenPipeError. After the
    first failure the descriptor of the stream leads to the null device: the rest of the
    buffer would fail again when the interpreter ends.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write `text` and return the number of its characters."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._fail(error)

    def flush(self) -> None:
        """Write the rest of the buffer."""
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
"""Characters of numbers and units; all other characters are escaped."""


def spelled(text: str, encoding: str) -> str:
    """Return `text` without the characters that an encoding does not have."""
    return text.encode(encoding, SPELLED).decode(encoding)


def _spell(error: UnicodeError) -> tuple[str | bytes, int]:
    """Return the text for the characters of an error, and the next position."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    if ascii_text := IN_ASCII.get(error.object[error.start]):
        return ascii_text, error.start + 1
    return codecs.backslashreplace_errors(error)


codecs.register_error(SPELLED, _spell)


def check_output_stream() -> None:
    """Replace standard output by an `Output` that can write every character."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors=SPELLED)
    if sys.stdout is not None:  # None if the stream is closed
        sys.stdout = Output(sys.stdout)


def flush_output() -> None:
    """Write the rest of the buffer of standard output, with the errors of `Output`."""
    if sys.stdout is not None:
        sys.stdout.flush()
