"""What a stored spec says of how it was launched."""

import pytest

from sweep.tables.stored_spec import command_of
from tests.searches import TINY
from tests.studies import SMALL


@pytest.mark.parametrize(
    ("spec", "command"),
    [
        (SMALL, "launch"),
        (TINY, "search"),
        ("", "launch"),
        ("3", "launch"),
        ("search: [", "launch"),
        ("a: 1\n---\nb: 2\n", "launch"),
    ],
)
def test_any_text_has_a_command(spec: str, command: str) -> None:
    assert command_of(spec) == command
