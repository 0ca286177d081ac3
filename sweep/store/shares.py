"""Shares of a study: launches on several machines divide its trials by their ids, and
need not know of each other.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.errors import ChoiceError
from sweep.text import shortened

WRITTEN = re.compile(r"([0-9]{1,6})/([0-9]{1,6})")
MOST = 999_999
DIGITS = 8


@dataclass(frozen=True)
class Share:
    """Share `number` of `of`, counted from 1. Which trials are in it follows only from
    their ids.

    So every launch with the same `of` divides the trials alike, and a trial that is
    added to the study changes the share of no other.
    """

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @classmethod
    def parse(cls, text: str) -> "Share":
        """A share written as "3/16". Raises ChoiceError."""
        found = WRITTEN.fullmatch(text.strip())
        if found is None:
            raise ChoiceError(
                f'share "{shortened(text)}" is not of the form 3/16, with numbers to'
                f" {MOST:,}"
            )
        number, of = map(int, found.groups())
        if not 1 <= number <= of:
            there = f"1/{of} to {of}/{of}" if of else "1/1 on"
            raise ChoiceError(f"there is no share {text}: they count from {there}")
        return cls(number, of)

    def has(self, trial_ids: Iterable[str]) -> NDArray[np.bool_]:
        """Which of the trials are in this share."""
        return np.array(
            [
                int(trial[:DIGITS], 16) % self.of == self.number - 1
                for trial in trial_ids
            ],
            np.bool_,
        )
