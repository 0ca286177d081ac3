"""A stored trial is named by its id, or by the beginning of it."""

from collections import Counter

import pytest

from sweep.errors import ChoiceError
from sweep.tables.stored_study import StoredStudy
from tests.plotted import study


def ids() -> list[str]:
    return sorted(study("grid").store.trial_ids())


def shortest(trial: str) -> str:
    """As much of an id as no other begins with."""
    return next(
        trial[:digits]
        for digits in range(1, len(trial) + 1)
        if sum(one.startswith(trial[:digits]) for one in ids()) == 1
    )


def test_the_beginning_of_an_id_is_enough_if_no_other_begins_so() -> None:
    for trial in ids()[::9]:
        begun = shortest(trial)
        assert len(begun) < len(trial)
        assert study("grid").trial_id(begun) == trial
        assert study("grid").trial(begun).row["trial_id"] == trial
        assert study("grid").trial(trial).row["trial_id"] == trial


def test_the_flight_of_a_trial_is_found_by_it() -> None:
    flying = study("flying")
    (trial, *_) = flying.store.trial_ids()
    frames, bodies = flying.trajectory(trial[:10])
    assert bodies.tobytes() == flying.trajectory(trial)[1].tobytes()
    assert len(frames) == len(bodies) > 1


@pytest.mark.parametrize("method", [StoredStudy.trial, StoredStudy.trajectory])
def test_a_beginning_of_several_ids_is_refused_with_some_of_them(method) -> None:
    """Of 54 ids two at least have the same first digit."""
    digit, count = Counter(one[0] for one in ids()).most_common(1)[0]
    assert count > 3
    first = [one for one in ids() if one.startswith(digit)][:3]
    words = f'the ids of {count} trials begin with "{digit}": {", ".join(first)}, ...;'
    with pytest.raises(ChoiceError) as refused:
        method(study("grid"), digit)
    assert str(refused.value) == f"study grid: {words} give more digits"


@pytest.mark.parametrize("given", ["", "nonsense", "g"])
def test_what_begins_no_id_is_unknown(given: str) -> None:
    with pytest.raises(ChoiceError, match=f'unknown trial "{given}"'):
        study("grid").trial(given)
