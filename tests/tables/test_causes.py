"""Causes of trials that are not done: trials with the same cause are together."""

import pandas as pd

from sweep.tables.causes import Cause, causes_of


def test_trials_that_ended_at_different_steps_have_one_cause() -> None:
    ended = [
        ("done", ""),
        ("timeout", "time limit of 1 s reached after step 40"),
        ("failed", "Traceback\nValueError: no room"),
        ("timeout", "time limit of 1 s reached after step 38"),
        ("diverged", "a velocity was not a finite number after step 2"),
        ("timeout", "time limit of 2 s reached after step 38"),
    ]
    trials = pd.DataFrame(ended, columns=["status", "error"])
    assert causes_of(trials.assign(trial_id=list("abcdef"))) == [
        Cause("timeout", 2, "time limit of 1 s reached", "b"),
        Cause("failed", 1, "ValueError: no room", "c"),
        Cause("diverged", 1, "a velocity was not a finite number", "e"),
        Cause("timeout", 1, "time limit of 2 s reached", "f"),
    ]
