"""Shards of a study, for launches on several machines.

They divide its trials by their ids, and need not know of each other.
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
    """Shard `number` of `of`, counted from 1; its trials follow only from their ids.

    So every launch with the same `of` divides the trials in the same way, and a trial
    that is added to the study changes the shard of no other.
    """

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @classmethod
    def parse(cls, text: str) -> "Share":
        """Return a shard written as "3/16".

        Raises ChoiceError.
        """
        match = WRITTEN.fullmatch(text.strip())
        if match is None:
            raise ChoiceError(
                f'share "{shortened(text)}" is not of the form 3/16, with numbers to'
                f" {MOST:,}"
            )
        number, of = map(int, match.groups())
        if not 1 <= number <= of:
            allowed = f"1/{of} to {of}/{of}" if of else "1/1 on"
            raise ChoiceError(f"there is no share {text}: they count from {allowed}")
        return cls(number, of)

    def has(self, trial_ids: Iterable[str]) -> NDArray[np.bool_]:
        """Return which of the trials are in this shard."""
        return np.array(
            [
                int(trial[:DIGITS], 16) % self.of == self.number - 1
                for trial in trial_ids
            ],
            np.bool_,
        )
