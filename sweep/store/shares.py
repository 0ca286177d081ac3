"""Shards of a study, for launches on several machines.

The id of a trial determines the shard, so launches need no communication.
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
    """Shard `number` of `of`, counted from 1; the id of a trial determines its shard.

    So all launches with an equal `of` divide the trials equally. A new trial of the
    study does not change the shards of existing trials.
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
                f'shard "{shortened(text)}" is not of the form 3/16, with numbers up to'
                f" {MOST:,}"
            )
        number, of = map(int, match.groups())
        if not 1 <= number <= of:
            allowed = f"1/{of} to {of}/{of}" if of else "1/1 and higher"
            raise ChoiceError(f"there is no shard {text}: shards are {allowed}")
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
