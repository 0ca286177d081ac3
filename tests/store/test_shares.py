"""Shares of a study."""

import hashlib

import numpy as np
import pytest

from sweep.errors import ChoiceError
from sweep.store.shares import Share

IDS = [
    hashlib.sha256(str(number).encode()).hexdigest()[:24] for number in range(10_000)
]


def test_shares_divide_the_trials_evenly() -> None:
    """A share of 16 of 10,000 hashes has 625 of them with a deviation of 24.2; 5
    deviations: 1e-5 for one of 16.
    """
    masks = np.array([Share(number, 16).has(IDS) for number in range(1, 17)])
    assert (masks.sum(axis=0) == 1).all()
    assert abs(masks.sum(axis=1) - 625).max() < 5 * 24.2


def test_the_whole_is_one_share() -> None:
    assert Share(1, 1).has(IDS).all()
    assert Share(1, 1).has([]).tolist() == []


def test_a_share_is_written_as_it_is_read() -> None:
    assert Share.parse("3/16") == Share(3, 16)
    assert str(Share(3, 16)) == "3/16"


@pytest.mark.parametrize("text", ["", "3", "3/", "a/b", "-1/3", "1/2/3", "1.5/2"])
def test_what_is_no_share_is_refused(text: str) -> None:
    with pytest.raises(ChoiceError, match="not of the form 3/16"):
        Share.parse(text)


@pytest.mark.parametrize("text", ["0/16", "17/16", "0/0", "1/0"])
def test_there_are_only_shares_from_one_on(text: str) -> None:
    with pytest.raises(ChoiceError, match="shards are 1/"):
        Share.parse(text)
