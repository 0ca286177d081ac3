"""A JupyterLab of its own in a process of its own, and a notebook in it that a browser
has open.
"""

import importlib.util
import json
import os
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import nbformat
from nbformat.v4 import new_code_cell, new_notebook
from playwright.sync_api import Browser, Locator

from tests.web.chromium import PATIENCE

NEWS = (
    "config/lab/user-settings/@jupyterlab/apputils-extension/"
    "notification.jupyterlab-settings"
)
NO_NEWS = {"fetchNews": "false", "checkForUpdates": False}
"""Without which JupyterLab asks whether it may look for news."""
OPTIONS = (
    "--no-browser",
    "--expose-app-in-browser",
    "--ServerApp.ip=127.0.0.1",
    "--ServerApp.port=0",
    "--ServerApp.allow_root=True",
    "--ServerApp.use_redirect_file=False",
    "--LabApp.news_url=None",
    "--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate",
    "--LabApp.extension_manager=readonly",
)
FOLDERS = {
    "JUPYTER_CONFIG_DIR": "config",
    "JUPYTER_DATA_DIR": "data",
    "JUPYTER_RUNTIME_DIR": "runtime",
    "IPYTHONDIR": "ipython",
}


class Lab:
    """A running JupyterLab: the folder of its notebooks, where it answers, and the word
    that lets one in.
    """

    def __init__(self, folder: Path, url: str, token: str) -> None:
        self.folder, self.url, self.token = folder, url, token


@contextmanager
def running_lab(home: Path) -> Iterator[Lab]:
    """JupyterLab with its notebooks in `home`/notebooks and all that is its own beside
    it.

    Raises RuntimeError with the way to install it where there is none, and TimeoutError
    where it does not start.
    """
    if importlib.util.find_spec("jupyterlab") is None:
        raise RuntimeError(
            'JupyterLab is not installed: pip install "boidsweep[notebook]", which make'
            " test-slow does"
        )
    own = {name: str(home / folder) for name, folder in FOLDERS.items()}
    for folder in [*own.values(), home / "notebooks"]:
        Path(folder).mkdir()
    (home / NEWS).parent.mkdir(parents=True)
    (home / NEWS).write_text(json.dumps(NO_NEWS))
    token = secrets.token_hex(16)
    with (home / "lab.log").open("w") as log:
        process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "jupyter",
                "lab",
                *OPTIONS,
                f"--IdentityProvider.token={token}",
            ],
            cwd=home / "notebooks",
            env=os.environ | own,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    try:
        yield Lab(home / "notebooks", _address(home, process), token)
    finally:
        process.send_signal(signal.SIGTERM)  # upon which it ends its kernels
        process.wait(PATIENCE)


def _address(home: Path, process: subprocess.Popen[bytes]) -> str:
    """Where it answers, as it writes it down when it does."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline and process.poll() is None:
        for found in (home / "runtime").glob("jpserver-*.json"):
            try:
                return str(json.loads(found.read_text())["url"])
            except ValueError:
                pass  # half written
        time.sleep(0.1)
    raise TimeoutError(
        f"JupyterLab does not start: {(home / 'lab.log').read_text()[-2000:]}"
    )


KERNEL = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}
}
NOTEBOOK = "jupyterapp.shell.currentWidget"
RUN = """async (index) => {
  const { content } = jupyterapp.shell.currentWidget;
  content.activeCellIndex = index;
  content.deselectAll();
  await jupyterapp.commands.execute("notebook:run-cell");
  return content.widgets[index].model.sharedModel.toJSON().outputs;
}"""


class Notebook:
    """A new notebook, open in a page of its own whose kernel is ready; and what has
    gone wrong in that page.
    """

    def __init__(self, browser: Browser, lab: Lab, name: str, cells: list[str]) -> None:
        self.path = lab.folder / name
        nbformat.write(
            new_notebook(
                cells=[new_code_cell(cell) for cell in cells], metadata=KERNEL
            ),
            self.path,
        )
        self.page = browser.new_page(
            viewport={"width": 1280, "height": 1060}, color_scheme="light"
        )
        self.complaints: list[str] = []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on(
            "console",
            lambda said: (
                self.complaints.append(said.text) if said.type == "error" else None
            ),
        )
        self.page.on("request", lambda request: self._is_at_home(request.url))
        self.page.goto(f"{lab.url}lab/tree/{name}?token={lab.token}&reset")
        self.until_idle()

    def _is_at_home(self, url: str) -> None:
        if not url.startswith(("http://127.0.0.1:", "data:", "blob:")):
            self.complaints.append(f"asks for {url}")

    @property
    def view(self) -> Locator:
        """The view that is on the screen."""
        return self.page.locator(".boidsweep:visible")

    @property
    def cells(self) -> list[str]:
        """The text of each cell."""
        return list(
            self.page.evaluate(
                f"{NOTEBOOK}.content.widgets.map((cell) =>"
                " cell.model.sharedModel.source)"
            )
        )

    def run(self, index: int) -> list[dict[str, Any]]:
        """Run a cell and return its outputs, as a notebook has them."""
        return list(self.page.evaluate(RUN, index))

    def said(self, index: int) -> str:
        """What a cell that is run prints."""
        (output,) = self.run(index)
        assert output["output_type"] == "stream", output
        return "".join(output["text"])

    def restart(self) -> None:
        """Restart the kernel, and say yes when JupyterLab asks."""
        self.page.evaluate(
            "void jupyterapp.commands.execute('notebook:restart-kernel')"
        )
        self.page.locator(".jp-Dialog .jp-mod-accept").click()

    def use_theme(self, theme: str) -> None:
        """Let JupyterLab wear a theme, which it keeps for all its pages."""
        self.page.evaluate(
            "theme => jupyterapp.commands.execute('apputils:change-theme', { theme })",
            theme,
        )

    def until_idle(self) -> None:
        """Wait until the kernel is there and has nothing to do."""
        self.until(
            f"window.jupyterapp && {NOTEBOOK}?.sessionContext?.session?.kernel?.status"
            " === 'idle'"
        )

    def until(self, expression: str) -> None:
        """Wait until a JavaScript expression is true."""
        self.page.wait_for_function(expression)

    def until_words(self, part: str, words: str) -> None:
        """Wait until a part of the view, by its class, has these words."""
        self.view.locator(f".{part}").get_by_text(words).first.wait_for()

    def until_step(self, least: int) -> int:
        """Wait for a step or a later one, and return the step that is on the screen."""
        self.until(
            "Number(document.querySelector('.boidsweep .clock').textContent.split('"
            f" ')[1]) >= {least}"
        )
        return int((self.view.locator(".clock").inner_text()).split()[1])

    def save(self) -> None:
        """Save it, and wait for that."""
        self.page.evaluate('jupyterapp.commands.execute("docmanager:save")')
