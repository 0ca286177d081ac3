"""All errors that a user can fix. Any module can import this module at no cost.

    UserError              one sentence: the value, the allowed values and the fix

        SpecError          a spec is not valid
        CodeError          custom code cannot be used, or may not run
        ChoiceError        a study does not have the choice of the user

        StoreError         results cannot be read or written
            UnreadableError    a stored file that no launch writes
            UnreachableError   the object store does not answer
            TooLargeError      a table exceeds this machine's memory

        OutputError        an output file cannot be written
        WorkersError       no worker can run a job
        CacheError         no folder can keep compiled kernels
        FailedTrialsError  more trials failed than the spec allows

A command prints the sentence on stderr and ends with the `exit_code` of the error.
"""

from collections.abc import Sequence
from typing import Any


class UserError(Exception):
    """An error that a user can fix: one sentence with the value and the allowed values.

    `reason` is the sentence without the name of the `study` and the `kind` of figure. A
    name is "" if the error concerns no study or no figure. A list of several reasons
    has each name once.
    """

    exit_code = 2

    def __init__(self, reason: str, study: str = "", kind: str = "") -> None:
        subject = f"study {study}: " if study else ""
        super().__init__(f"{subject}{kind} {reason}" if kind else f"{subject}{reason}")
        self.reason = reason
        self.study = study
        self.kind = kind


class SpecError(UserError):
    """A mistake in a spec: one sentence that starts with the file and line.

    Each of several mistakes has a line of the message, and an error in `several`.
    `line` is the line number in the file, or 0 without a line. `place` has the keys and
    indices that lead to the mistake. `meant` has the keys that lead to the key that was
    probably meant, if the mistake is a misspelt key.
    """

    def __init__(
        self,
        reason: str,
        line: int = 0,
        several: "Sequence[SpecError]" = (),
        place: tuple[str | int, ...] = (),
    ) -> None:
        super().__init__(reason)
        self.line = line
        self.several = tuple(several)
        self.place = place
        self.meant: tuple[str | int, ...] = ()

    @property
    def mistakes(self) -> "tuple[SpecError, ...]":
        """All errors in `several`, or only this error."""
        return self.several or (self,)


class CodeError(UserError):
    """Custom code that cannot be used, or that the user has not allowed to run.

    The message names the file and the line. `file` is the file that the spec names. The
    mistake may be in an imported file.
    """

    def __init__(self, reason: str, file: str = "") -> None:
        super().__init__(reason)
        self.file = file


class ChoiceError(UserError):
    """A choice that the study does not have, such as a metric, point or figure kind."""


class StoreError(UserError):
    """Results that cannot be read or written, with the file and the fix."""


class UnreadableError(StoreError):
    """A stored file that no launch has written in this form.

    `wrong` is the defect of the `file`, and `remedy` is the fix.
    """

    def __init__(self, file: Any, wrong: str, remedy: str) -> None:
        super().__init__(f"{file}: {wrong}; {remedy}")
        self.args = (file, wrong, remedy)  # a pickle calls the class with them
        self.file = file
        self.wrong = wrong
        self.remedy = remedy

    def __str__(self) -> str:
        return self.reason


class UnreachableError(StoreError):
    """An object store, `server`, that does not answer now and may answer later."""

    def __init__(self, message: str, server: Any) -> None:
        super().__init__(message)
        self.server = server


class TooLargeError(StoreError):
    """A table that is larger than the memory of this machine."""


class OutputError(UserError):
    """A file for the user that cannot be written, or may not be replaced."""


class WorkersError(UserError):
    """Workers that cannot run or report a job, for example because all workers die."""


class CacheError(UserError):
    """A folder that cannot keep compiled kernels.

    `settle` raises the error if no folder can.
    """


class FailedTrialsError(UserError):
    """More failed trials than the spec allows: the first error, and the fix."""

    exit_code = 1
