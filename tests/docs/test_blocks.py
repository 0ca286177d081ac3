"""Every code block of every page is run, or says why not."""

import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from shutil import copy, copytree
from tempfile import TemporaryDirectory

import pytest
import typer.main

from docs.building.blocks import Block, BlockError, PageRun, blocks, words
from docs.building.documents import pages_of_documents, read
from kernels.catalogue import BUILT_IN
from sweep.cli import app
from sweep.design.design import expand
from sweep.own_code.reading import load_specs
from sweep.spec.settings import settings_of
from tests import ROOT
from tests.cases import slow_but
from tests.commands import run_trials_here, sweep
from tests.plotted import SEARCHED
from tests.searches import asked_by
from tests.studies import SMALL, launched

GUIDE = "docs/guide/"
PAGES = [path for path in pages_of_documents() if list(blocks(path, read(path)))]
LONG = {
    *(page for page in PAGES if page.startswith(GUIDE)),
    "docs/recipes.md",
    "docs/tutorials/one-question.md",
    "docs/tutorials/own-model.md",
    "docs/tutorials/phase-diagram.md",
    "docs/tutorials/recorded-school.md",
    "docs/tutorials/search.md",
}
"""Pages whose trials, or whose compilation, take more than some seconds."""

RECORDED = """
study: nguyen2024/separation
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 60}
sweep: {separation_weight: [0.5, 1, 2]}
replicates: 10
seed: 5
record: {series: [speed], every: 2, heatmaps: true, trajectories: true}
"""
ROOM = """
study: my/room
model: aziel_chen2025
preset: as_run
fixed: {n: 4, steps: 4}
sweep: {detail: {ablate: as_written}}
replicates: 1
record: {trajectories: true}
"""
SAMPLED = """
study: my/sampled
model: nguyen2024
preset: as_run
fixed: {n: 4, steps: 4}
sweep:
  weights: {sample: lhs, points: 40, separation_weight: {uniform: [0, 2]}}
replicates: 1
record: {metrics: [speed]}
"""
FIRST, SECOND = (
    SMALL.replace("study: small", f"study: my/{name}") for name in ("first", "second")
)
STUDIES = [RECORDED, ROOM, SAMPLED, FIRST, SECOND]
"""Small studies of the names that pages load, which they do not launch."""


def every_block() -> list[Block]:
    return [block for path in PAGES for block in blocks(path, read(path))]


def at(block: Block) -> str:
    return f"{block.page}:{block.line}"


def command(folder: Path, arguments: list[str]) -> str:
    """What a command prints, run within this process."""
    finished = sweep(folder, *arguments)
    if finished.returncode:
        raise BlockError(f"sweep {' '.join(arguments)}: {finished.stderr}")
    return finished.stdout


def read_whole(spec: str) -> None:
    """Raise where a text is no whole spec, or one of a single point."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "spec.yaml"
        path.write_text(spec, encoding="utf-8")
        for study in load_specs(path):
            assert "search" in study.sections or expand(study).n_points > 1


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results that the pages of the guide find, and a spec beside."""
    folder = tmp_path_factory.mktemp("stored")
    for spec in STUDIES:
        launched(spec, folder / "results")
    gains = SEARCHED.replace("study: searched", "study: my/gains")
    asked_by(gains, folder / "results")
    (folder / "spec.yaml").write_text(SMALL, encoding="utf-8")
    return folder


@pytest.fixture
def run_in(
    tmp_path: Path, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Callable[[str], PageRun]:
    """The run of a page in an empty folder; its trials run in this process."""
    monkeypatch.setenv("COLUMNS", "100")
    run_trials_here(monkeypatch)

    def begun(page: str) -> PageRun:
        if page == "README.md":
            few = RECORDED.replace("replicates: 10", "replicates: 4")
            launched(few, tmp_path / "results")
        if page == "docs/tutorials/recorded-school.md":
            copy(ROOT / "examples" / "school.csv", tmp_path)
        if page.startswith(GUIDE):
            stored = request.getfixturevalue("stored")
            copytree(stored, tmp_path, dirs_exist_ok=True)
        return PageRun(tmp_path, command, read_whole)

    return begun


@pytest.mark.parametrize(
    "page", slow_but([page for page in PAGES if page not in LONG], PAGES)
)
def test_the_blocks_of_a_page_run_in_its_order(
    page: str, run_in: Callable[[str], PageRun]
) -> None:
    run = run_in(page)
    for block in blocks(page, read(page)):
        run.run(block)


@pytest.mark.parametrize(
    "block",
    [block for block in every_block() if block.reason and block.language == "sh"],
    ids=at,
)
def test_commands_that_are_not_run_exist_with_their_options(block: Block) -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    for line in block.commands:
        first, *rest = words(line)
        if first != "sweep" or rest == ["--version"]:
            continue
        options = {name for one in commands[rest[0]].params for name in one.opts}
        given = {word.partition("=")[0] for word in rest if word.startswith("--")}
        assert given <= options, line
        assert settings_given(rest) <= settings_known(rest), line


def after(option: str, words: list[str]) -> list[str]:
    """What follows each `option` of a command."""
    return [given for one, given in pairwise(words) if one == option]


def settings_given(words: list[str]) -> set[str]:
    return {given.partition("=")[0] for given in after("--set", words)}


def settings_known(words: list[str]) -> set[str]:
    """Those of the model that a command names, and none without a model."""
    models = after("--model", words)
    return {name for model in models for name in settings_of(model, BUILT_IN)}


def test_no_fence_is_overlooked() -> None:
    """Each line that opens or closes a fence belongs to a block or a directive."""
    for path in PAGES:
        fences = re.findall(r"^`{3,}", read(path), re.MULTILINE)
        directives = re.findall(r"^`{3,}\{", read(path), re.MULTILINE)
        found = list(blocks(path, read(path)))
        assert len(fences) == 2 * (len(found) + len(directives)), path


def page_of(text: str, folder: Path) -> None:
    run = PageRun(folder, command, read_whole)
    for block in blocks("page.md", text):
        run.run(block)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("```toml\na = 1\n```\n", 'page.md:1: a block of "toml" is run by nothing'),
        ("\n```python\nassert False\n```\n", "page.md:2: AssertionError"),
        ("```sh\nsweep lunch a.yaml\n```\n", "sweep lunch a.yaml: "),
        ("```sh\nfalse\n```\n", "false: exit code 1"),
        ("```yaml\nstudy: a\n```\n", 'page.md:1: SpecError: .*"model"'),
        ("```python\nprint(1)\n```\n```text\n2\n```\n", "page.md:4: not in the output"),
        ("```python\nprint(12)\n```\n```text\n2...\n```\n", "page.md:4: not in"),
    ],
)
def test_a_block_that_does_not_do_what_its_page_says_is_an_error(
    text: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(BlockError, match=message):
        page_of(text, tmp_path)


def test_files_output_and_reasons_are_heeded(tmp_path: Path) -> None:
    page_of(
        "<!-- file: sub/a.py -->\n```python\nb = 7\n```\n"
        "```sh\ncat sub/a.py | tr b c\n```\n```text\n...\nc  =  7\n```\n"
        "```text\nc = ...\n```\n"
        "<!-- not run: it would fail -->\n```sh\nfalse\n```\n",
        tmp_path,
    )
    assert (tmp_path / "sub" / "a.py").read_text(encoding="utf-8") == "b = 7\n"


def test_pages_with_exceptions_are_there() -> None:
    assert set(PAGES) >= LONG
    assert sum(page.startswith(GUIDE) for page in PAGES) > 30
