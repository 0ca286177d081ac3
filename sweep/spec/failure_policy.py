"""Policy of a spec for failed trials: retries, failure budget, memory of a worker."""

import math
import re
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Annotated, Any, Literal, get_args

from sweep.errors import SpecError
from sweep.spec.contents import SHARE, Content, OneOf, Whole, share
from sweep.spec.document import Entry
from sweep.spec.keys import Key, read_values
from sweep.spec.mistakes import Mistakes
from sweep.spec.schema_parts import Schema
from sweep.text import unknown

OnError = Literal["record", "retry", "stop"]

RETRIES = 2
UNITS = {
    "B": 1,
    "kB": 10**3,
    "MB": 10**6,
    "GB": 10**9,
    "KiB": 2**10,
    "MiB": 2**20,
    "GiB": 2**30,
}
LEAST_MEMORY = 400 * 2**20
"""Least memory limit of a worker, in bytes.

The interpreter, the libraries and the compiled kernels take about half of this memory.
"""
MOST_MEMORY = 2**50
NUMBER = r"[0-9]{1,15}(?:\.[0-9]{1,9})?"
SIZE = re.compile(rf"({NUMBER}) ?([A-Za-z]+)")


@dataclass(frozen=True)
class FailureBudget(Content[int | Fraction]):
    """A number of trials, or a percentage of all trials, which reads as a Fraction."""

    @property
    def words(self) -> str:
        """The two forms of a budget."""
        return "a number of trials from 0, or a percentage from 0% to 100%"

    def read(self, entry: Entry) -> int | Fraction:
        """Return the number of trials, or the fraction of all trials."""
        if isinstance(entry.value, int) and not isinstance(entry.value, bool):
            return entry.whole(0)
        if (part := share(entry.value)) is not None:
            return part
        wrong = entry.expected(self.words)
        if isinstance(entry.value, float) and 0.0 < entry.value < 1.0:
            meant = f'; did you mean "{100 * entry.value:g}%"?'
            raise SpecError(f"{wrong}{meant}", wrong.line)
        raise wrong

    def schema(self) -> Schema:
        """Return the JSON Schema of a number or a percentage."""
        part = {"type": "string", "pattern": f"^{SHARE.pattern}$"}
        return {"anyOf": [Whole(0).schema(), part]}

    def write(self, value: int | Fraction) -> Any:
        """Return the number, or the fraction as a percentage."""
        if not isinstance(value, Fraction):
            return value
        return f"{float(100 * value):.9f}".rstrip("0").rstrip(".") + "%"


@dataclass(frozen=True)
class MemorySize(Content[int]):
    """A size with a unit, which reads as a number of bytes."""

    @property
    def words(self) -> str:
        """The form of a size, with examples."""
        return 'a size with a unit, such as "2 GiB" or "1500 MB"'

    def read(self, entry: Entry) -> int:
        """Return the size in bytes."""
        match = SIZE.fullmatch(entry.value) if isinstance(entry.value, str) else None
        if match is None:
            raise entry.expected(self.words)
        number, unit = match.groups()
        if unit not in UNITS:
            raise entry.error(_unknown_unit(unit))
        size = math.floor(Fraction(number) * UNITS[unit])
        if size < LEAST_MEMORY:
            raise entry.error(
                f'"{entry.name}" is {entry.value}, and must be at least'
                f" {LEAST_MEMORY // 2**20} MiB:"
                " a worker uses about half of this before the first trial"
            )
        if size > MOST_MEMORY:
            raise entry.error(
                f'"{entry.name}" is {entry.value}, more than the memory of any machine'
            )
        return size

    def schema(self) -> Schema:
        """Return the JSON Schema of a size."""
        return {"type": "string", "pattern": rf"^{NUMBER} ?({'|'.join(UNITS)})$"}

    def write(self, value: int) -> Any:
        """Return the size in bytes, with the unit."""
        return f"{value} B"


@dataclass(frozen=True)
class Policy:
    """Policy for failed trials.

    A trial fails by an exception, a dead worker, too much time or too much memory. A
    trial that diverges is not a failed trial.

    Attributes
    ----------
    on_error : {"record", "retry", "stop"}, default "record"
    retries : int, default 0
        Number of further attempts for a failed trial.
    budget : int or Fraction, optional
        Number of trials, or fraction of all trials of the study. The run ends when more
        trials have failed. None for no limit.
    memory : int, optional
        Memory limit of a worker, in bytes.
    """

    on_error: Annotated[
        OnError,
        Key(
            OneOf("on_error", get_args(OnError)),
            "record: store a failed trial and continue. retry: run failed trials again"
            " at the end. stop: end the launch at the first failed trial",
            example="retry",
        ),
    ] = "record"
    retries: Annotated[
        int,
        Key(
            Whole(1),
            "number of further attempts per failed trial; only with on_error: retry",
            otherwise=f"{RETRIES}",
            example="3",
        ),
    ] = 0
    budget: Annotated[
        int | Fraction | None,
        Key(
            FailureBudget(),
            "largest number of failed trials, or percentage of all trials. A launch"
            " with more failed trials ends. Not with on_error: stop",
            name="failure_budget",
            otherwise="no limit",
            example="5%",
        ),
    ] = None
    memory: Annotated[
        int | None,
        Key(
            MemorySize(),
            f"memory limit of a worker; at least {LEAST_MEMORY // 2**20} MiB",
            name="memory_limit",
            otherwise="no limit",
            example="2 GiB",
        ),
    ] = None

    def allowed(self, trials: int) -> int | None:
        """Return the largest number of failed trials of a run; None for no limit."""
        if self.on_error == "stop":
            return 0
        return (
            math.floor(self.budget * trials)
            if isinstance(self.budget, Fraction)
            else self.budget
        )

    def in_words(self, trials: int) -> str:
        """Return the policy for a number of trials in words; "" for the default."""
        allowed = self.allowed(trials)
        phrases = []
        if self.retries:
            phrases.append(
                f"failed trials run again at most {self.retries:,}"
                f" {'time' if self.retries == 1 else 'times'}"
            )
        if self.on_error == "stop":
            phrases.append("the launch ends at the first failed trial")
        elif allowed is not None:
            phrases.append(
                f"the launch ends when more than {allowed:,} of {trials:,} trials have"
                " failed"
            )
        if self.memory is not None:
            phrases.append(
                "a trial fails if the worker uses more than"
                f" {self.memory / 2**20:,.0f} MiB"
            )
        return "; ".join(phrases)


def read_policy(root: Entry) -> Policy:
    """Return the policy of a spec for failed trials, or raise SpecError."""
    mistakes = Mistakes()
    values = read_values(Policy, root, mistakes)
    retries = root.get("retries")
    budget = root.get("failure_budget")
    written = root.get("on_error")
    on_error = values["on_error"]
    # If `on_error` itself is wrong, only this mistake is reported.
    sure = written is None or written.value == on_error
    with mistakes.noted():
        if retries and sure and on_error != "retry":
            raise retries.error(
                f'"retries" needs "on_error: retry", and on_error is {on_error}: change'
                ' "on_error" or remove "retries"'
            )
    with mistakes.noted():
        if budget and sure and on_error == "stop":
            raise budget.error(
                '"failure_budget" needs "on_error: record" or "retry": "on_error: stop"'
                " ends a launch at the first failed trial"
            )
    mistakes.check()
    policy = Policy(**values)
    if policy.on_error == "retry" and not retries:
        return replace(policy, retries=RETRIES)
    return policy


def policy_dependencies() -> Schema:
    """Return the checks of `read_policy` of several keys as JSON Schema, by key."""
    retried = {"properties": {"on_error": {"const": "retry"}}, "required": ["on_error"]}
    not_stopped = {"properties": {"on_error": {"enum": ["record", "retry"]}}}
    return {"retries": retried, "failure_budget": not_stopped}


def _unknown_unit(unit: str) -> str:
    """Return the sentence that reports an unknown unit.

    The most frequent mistake is a wrong case of letters, which `unknown` does not find.
    """
    close = next(
        (written for written in UNITS if written.lower() == unit.lower()), None
    )
    if close is None:
        return unknown("unit of memory", unit, UNITS)
    return (
        f'unknown unit of memory "{unit}"; did you mean "{close}"? Allowed:'
        f" {', '.join(UNITS)}"
    )
