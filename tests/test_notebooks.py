"""The notebooks run from nothing, and what is written in them is what comes out."""

import ast
import re
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode

from notebooks.execute import METADATA, executed, lacking
from tests import ROOT

FOLDER = ROOT / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
MOST_BYTES = 300_000
MACHINE = re.compile(
    r"/(home|root|tmp|usr|opt|var|private|Users|work)/|[A-Z]:\\|site-packages"
)
"""Folders of one machine."""

IN_PROCESS = (
    "import sweep.workers.executors\n\nsweep.workers.executors.Loky ="
    " sweep.workers.executors.Serial\n"
)
"""Starting workers takes longer than these trials, and changes no bit of them."""

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


@pytest.fixture
def in_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Notebooks run their trials in their own process."""
    startup = tmp_path / "ipython" / "profile_default" / "startup"
    startup.mkdir(parents=True)
    (startup / "00-in-process.py").write_text(IN_PROCESS)
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))


def committed(path: Path) -> NotebookNode:
    return nbformat.read(path, as_version=4)


def code(notebook: NotebookNode) -> list[NotebookNode]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def words(cell: NotebookNode) -> list[object]:
    """What a cell put out, pictures by their kind alone: their bytes differ with the
    fonts of a machine.
    """
    return [
        (
            {
                kind: "" if kind.startswith("image/") else text
                for kind, text in output.data.items()
            }
            if "data" in output
            else (output.get("name"), output.get("text"))
        )
        for output in cell.outputs
    ]


def comes_to_what_is_committed(path: Path, folder: Path) -> None:
    if packages := lacking(path):
        pytest.skip(f"needs {', '.join(packages)}")
    fresh = executed(path, folder)
    assert (folder / "results" / "notebooks").is_dir()
    for cell, again in zip(code(committed(path)), code(fresh), strict=True):
        assert words(cell) == words(again), f"run make notebooks: {cell.source}"


@pytest.mark.slow
@pytest.mark.usefixtures("in_process")
def test_the_first_one_runs_from_nothing_to_what_is_committed(tmp_path: Path) -> None:
    comes_to_what_is_committed(FOLDER / "first_sweep.ipynb", tmp_path)


@pytest.mark.slow
@every_notebook
def test_with_workers_it_runs_to_what_is_committed_whole(
    path: Path, tmp_path: Path
) -> None:
    comes_to_what_is_committed(path, tmp_path)


@every_notebook
def test_every_cell_has_run_in_order_and_put_something_out(path: Path) -> None:
    cells = code(committed(path))
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    assert all(cell.outputs for cell in cells)
    assert any(
        "image/png" in output.get("data", {})
        for cell in cells
        for output in cell.outputs
    )


@every_notebook
def test_it_uses_what_is_public(path: Path) -> None:
    source = "\n".join(
        line
        for cell in code(committed(path))
        if not cell.source.startswith("%%")
        for line in cell.source.splitlines()
        if not line.startswith("%")
    )
    found = {
        name
        for node in ast.walk(ast.parse(source))
        for name in (
            [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else []
        )
        if name.partition(".")[0] in ("sweep", "kernels", "experiments")
    }
    assert found <= {"sweep", "sweep.analysis", "sweep.figures"}


@every_notebook
def test_no_cell_warns_or_fails(path: Path) -> None:
    outputs = [output for cell in code(committed(path)) for output in cell.outputs]
    assert {output.output_type for output in outputs} <= {
        "stream",
        "display_data",
        "execute_result",
    }
    assert {output.name for output in outputs if output.output_type == "stream"} <= {
        "stdout"
    }


@every_notebook
def test_it_says_nothing_of_the_machine_and_is_small(path: Path) -> None:
    notebook = committed(path)
    assert notebook.metadata == METADATA
    assert all(cell.metadata == {} for cell in notebook.cells)
    texts = [cell.source for cell in notebook.cells] + [
        str(words(cell)) for cell in code(notebook)
    ]
    assert [
        found[0] for text in texts for found in [MACHINE.search(text)] if found
    ] == []
    assert path.stat().st_size < MOST_BYTES
