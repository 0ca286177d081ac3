"""Run the notebooks of this folder from nothing and write them back with what came out:
make notebooks.

A notebook runs in an empty folder, so that nothing stored before helps it, and keeps no
time, path or version of that run. tests/test_notebooks.py runs them in the same way and
compares.
"""

import codecs
import os
import re
import shutil
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from traitlets.config import Config

from sweep.store.new_files import replacing

FOLDER = Path(__file__).parent
SECONDS = 600
IMPORTS = re.compile(r"^(?:from|import) (?P<package>\w+)", re.MULTILINE)
TERMINAL_STYLE = re.compile("\x1b\\[[0-9;]*m")
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def lacking(path: Path) -> list[str]:
    """Packages that a notebook imports and that are not installed, by name."""
    named = set[str]()
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.cell_type == "code" and not cell.source.startswith("%%"):
            named |= {match["package"] for match in IMPORTS.finditer(cell.source)}
    return sorted(package for package in named if not find_spec(package))


def executed(path: Path, empty: Path) -> NotebookNode:
    """The notebook at `path` after a run in the folder `empty`/notebooks, which is
    made.

    Raises nbclient's CellExecutionError where a cell fails.
    """
    folder = empty / "notebooks"
    folder.mkdir()
    shutil.copy(path, folder)
    notebook = nbformat.read(folder / path.name, as_version=4)
    # The `sweep` of a cell that begins with %%sh is that of this environment, whether
    # it is activated or not.
    env = os.environ | {
        "PATH": os.pathsep.join(
            [str(Path(sys.executable).parent), os.environ.get("PATH", "")]
        )
    }
    at = {"metadata": {"path": str(folder)}}
    # Sockets in a folder, as a free port may be taken before the kernel has it. Their
    # paths must be short.
    with tempfile.TemporaryDirectory() as sockets:
        kernel = {"transport": "ipc", "ip": str(Path(sockets) / "kernel")}
        NotebookClient(
            notebook,
            timeout=SECONDS,
            record_timing=False,
            coalesce_streams=True,
            store_widget_state=False,
            resources=at,
            config=Config(KernelManager=kernel),
        ).execute(env=env)
    return cleaned(notebook)


def cleaned(notebook: NotebookNode) -> NotebookNode:
    """The notebook without what says on which machine and when it ran, and without the
    bold type of terminals.
    """
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = NotebookNode()
        for output in cell.get("outputs", []):
            if output.output_type == "stream":
                output.text = TERMINAL_STYLE.sub("", output.text)
    return notebook


def main() -> None:
    """Run and rewrite every notebook, or those named on the command line."""
    for path in [Path(name) for name in sys.argv[1:]] or sorted(FOLDER.glob("*.ipynb")):
        if packages := lacking(path):
            print(f"{path.name} was left out: it needs {', '.join(packages)}")
            continue
        with tempfile.TemporaryDirectory() as empty:
            notebook = executed(path, Path(empty))
        with replacing(path) as file:
            nbformat.write(notebook, codecs.getwriter("utf-8")(file))
        print(path.name)


if __name__ == "__main__":
    main()
