"""The help of every command: its group, its summary, its options and its examples."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main

from docs.building.blocks import words
from sweep.cli import app
from sweep.cli.app import Command, Group
from sweep.method import own_methods
from sweep.text import description_of
from tests.commands import sweep

LONGEST = 60
"""Characters of a summary: one line in the list of commands."""
FEWEST_EXAMPLES = 2
GROUP_OF_ALL: Any = typer.main.get_command(app)
COMMANDS: dict[str, Command] = GROUP_OF_ALL.commands


@pytest.fixture(params=COMMANDS)
def command(request: pytest.FixtureRequest) -> Command:
    return COMMANDS[request.param]


def options_of(line: str) -> tuple[set[str], set[str]]:
    """The options in a line, and those of its command."""
    program, name, *rest = words(line)
    assert program == "sweep", line
    given = {word.partition("=")[0] for word in rest if word.startswith("--")}
    known = {name for one in COMMANDS[name].params for name in one.opts}
    return given, known


def printed_groups(output: str) -> Iterator[tuple[str, list[str]]]:
    """The titles of the panels in a help, each with the first words of its lines."""
    for panel in output.split("╭─ ")[1:]:
        title, *lines = panel.splitlines()
        found = [
            line.strip("│ ").split(" ")[0] for line in lines if line.startswith("│")
        ]
        yield title.partition(" ─")[0], found


def test_a_command_has_a_group(command: Command) -> None:
    assert command.rich_help_panel in list(Group)


def test_the_first_help_has_all_commands_below_their_groups(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    printed = dict(printed_groups(sweep(tmp_path, "--help").stdout))
    assert list(printed) == ["Options", *Group]
    for group in Group:
        members = {
            name
            for name, command in COMMANDS.items()
            if command.rich_help_panel == group
        }
        assert set(printed[group]) == members
        assert members


def test_a_report_of_a_method_is_an_analysis() -> None:
    made = [
        make
        for method in own_methods().values()
        for make in (*method.reports, *method.reports_of_results)
    ]
    groups = {make.__name__: COMMANDS[make.__name__].rich_help_panel for make in made}
    assert groups
    assert set(groups.values()) == {Group.analyse}


def test_a_summary_is_a_short_sentence(command: Command) -> None:
    summary, *_ = (command.help or "").split("\n\n")
    assert "\n" not in summary
    assert len(summary) <= LONGEST
    assert summary[0].isupper()
    assert summary[-1] == "."


def test_examples_in_python_stay_in_the_docstring() -> None:
    def spread() -> None:
        """Print the spread.

        Examples
        --------
        >>> study.report("spread")
        sweep spread my/first
        """

    spread_command = Command(name="spread", callback=spread)
    assert spread_command.examples == ["sweep spread my/first"]


def test_a_text_of_an_option_is_a_sentence(command: Command) -> None:
    for one in command.params:
        text = getattr(one, "help", None)
        if text is None:  # its class completes it for the help
            assert (command.name, one.name) == ("plot", "names")
            continue
        assert text[0].isupper(), one.name
        assert text[-1] == ".", one.name


def test_a_command_has_two_examples_with_options_that_exist(command: Command) -> None:
    assert len(command.examples) >= FEWEST_EXAMPLES
    assert any(words(line)[1] == command.name for line in command.examples)
    for line in command.examples:
        given, known = options_of(line)
        assert given <= known, line


@pytest.mark.parametrize("columns", ["40", "100"])
def test_examples_end_the_help_each_in_a_line(
    columns: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert command.name
    output = sweep(tmp_path, command.name, "--help").stdout
    *_, last = output.partition("\n Examples:\n")
    assert last.splitlines() == [f"   {line}" for line in command.examples]


def test_the_help_has_no_section_of_the_docstring(command: Command) -> None:
    assert command.help == description_of(command.callback).strip()
    assert "----" not in command.help


@pytest.mark.parametrize(
    ("name", "option", "parameter"),
    [
        ("power", "--power", "chance"),
        ("compare", "--correction", "together"),
        ("show", "--correction", "together"),
    ],
)
def test_options_have_the_name_of_the_field_too(
    name: str, option: str, parameter: str
) -> None:
    found = next(one for one in COMMANDS[name].params if option in one.opts)
    assert (found.name, found.opts) == (parameter, [f"--{parameter}", option])
