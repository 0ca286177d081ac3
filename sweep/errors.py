"""Every error that a user can mend, so that any module can raise it without weight.

    UserError              one sentence: what was given, what is allowed, the way out
        SpecError          a spec says what cannot be
        CodeError          code of the user's own cannot be used, or may not run
        ChoiceError        what was asked of a study cannot be given
        StoreError         results cannot be read or written
            UnreadableError    a stored file is not what a launch writes
            UnreachableError   the object store does not answer
            TooLargeError      a table is larger than this machine's memory
        OutputError        a file for the user cannot be written
        WorkersError       no worker can be given a job
        CacheError         no folder can keep compiled kernels
        FailedTrialsError  more trials have failed than the spec allows

A command ends with the `exit_code` of the error and its sentence on stderr.
"""

from collections.abc import Sequence
from typing import Any


class UserError(Exception):
    """What a user can mend: one sentence with what was given and what is allowed.

    `reason` is that sentence, less the name of the `study` and the `kind` of figure
    that it is about, where it is about any. Who lists several reasons says these once.
    """

    exit_code = 2

    def __init__(self, reason: str, study: str = "", kind: str = "") -> None:
        about = f"study {study}: " if study else ""
        super().__init__(f"{about}{kind} {reason}" if kind else f"{about}{reason}")
        self.reason, self.study, self.kind = reason, study, kind


class SpecError(UserError):
    """What is wrong with a spec, in one sentence that starts with its file and line.
    Where several things are wrong, each has a line of its own.

    `line` is the number of the line in the file, 0 where there is none, and `place` the
    keys and indices that lead there.
    """

    def __init__(
        self,
        reason: str,
        line: int = 0,
        several: "Sequence[SpecError]" = (),
        place: tuple[str | int, ...] = (),
    ) -> None:
        super().__init__(reason)
        self.line, self.several, self.place = line, tuple(several), place

    @property
    def mistakes(self) -> "tuple[SpecError, ...]":
        """The error of each mistake: of `several`, or this one alone."""
        return self.several or (self,)


class CodeError(UserError):
    """Code of the user's own cannot be used: the message names its file and line. Or it
    may not run, as nobody has said that it may.

    `file` is the one that a spec names, from which the mistake was met.
    """

    def __init__(self, reason: str, file: str = "") -> None:
        super().__init__(reason)
        self.file = file


class ChoiceError(UserError):
    """What was asked is not in the study: a metric, a point, a kind of figure."""


class StoreError(UserError):
    """Results cannot be read or written; the message names the file and the way out."""


class UnreadableError(StoreError):
    """A stored file is not what a launch writes: the `file`, what is `wrong` with it,
    and the `remedy`.
    """

    def __init__(self, file: Any, wrong: str, remedy: str) -> None:
        super().__init__(f"{file}: {wrong}; {remedy}")
        self.args = (file, wrong, remedy)
        self.file, self.wrong, self.remedy = file, wrong, remedy

    def __str__(self) -> str:
        return self.reason


class UnreachableError(StoreError):
    """The object store `server` does not answer now, and may do so later."""

    def __init__(self, message: str, server: Any) -> None:
        super().__init__(message)
        self.server = server


class TooLargeError(StoreError):
    """A table that this machine cannot hold."""


class OutputError(UserError):
    """A file for the user that cannot be written, or may not be replaced."""


class WorkersError(UserError):
    """No worker process can be given a job, or watched: none stays alive, or `run`
    cannot be sent to it.
    """


class CacheError(UserError):
    """A folder cannot keep compiled kernels; raised by `settle` where no folder can."""


class FailedTrialsError(UserError):
    """More trials have failed than the spec allows: the first error, and what to do."""

    exit_code = 1
