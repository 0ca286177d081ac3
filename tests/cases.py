"""Which cases of a test are slow."""

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(fast: Iterable[Any], every: Iterable[Any]) -> list[Any]:
    """All cases of a test, of which all but some are slow.

    Parameters
    ----------
    fast
        The cases that stay in the fast suite.
    every
        All cases of the test, in their order. A case of several arguments is a tuple.

    Raises
    ------
    ValueError
        A fast case is none of the test.
    """
    fast, every = list(fast), list(every)
    if unknown := [one for one in fast if one not in every]:
        raise ValueError(f"{unknown} are no cases of this test")
    return [
        one if one in fast else pytest.param(*arguments(one), marks=pytest.mark.slow)
        for one in every
    ]


def arguments(case: Any) -> tuple[Any, ...]:
    """The arguments of a case."""
    return case if isinstance(case, tuple) else (case,)
