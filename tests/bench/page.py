"""What the page draws of a run in a browser without a screen or a graphics card, on the
cores that the run has too.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser

from tests.bench.scale import FULL, Scale
from tests.web.chromium import running_browser

SECONDS = 8
WANTED = {100: 30, 1000: 30, 10_000: 10}
"""Frames a second that are drawn at least, by the number of boids."""

SPEC = """
study: page
model: aziel_chen2025
preset: as_run
fixed:
  {{map: empty, n: {n}, steps: 1000000, width: {width}, height: {height}, pixel: 10}}
replicates: 1
seed: 1
record: {{metrics: [speed, polarization], series: [speed, polarization]}}
"""

MEASURE = """(seconds) => new Promise((done) => {
  const { view, socket } = boidsweep;
  const { stage } = view;
  const [draw, take] = [stage.draw, socket.onmessage];
  const found = { drawn: 0, received: 0, busy: 0 };
  stage.draw = () => {
    const began = performance.now();
    draw.call(stage);
    found.drawn++;
    found.busy += performance.now() - began;
  };
  socket.onmessage = (message) => {
    if (message instanceof ArrayBuffer) found.received++;
    take(message);
  };
  const [began, step] = [performance.now(), stage.frame.step];
  view.send({ type: "run" });
  setTimeout(() => {
    const passed = (performance.now() - began) / 1000;
    const steps = (stage.frame.step - step) / passed;
    done({
      drawn: found.drawn / passed,
      received: found.received / passed,
      steps,
      busy: found.busy / found.drawn,
    });
  }, 1000 * seconds);
})"""


def spec(n: int) -> str:
    """N boids at the density of 100 in 800 x 600."""
    scale = (n / 100) ** 0.5
    return SPEC.format(n=n, width=round(800 * scale), height=round(600 * scale))


@contextmanager
def served(text: str) -> Iterator[str]:
    """The address of a server of this spec, a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "spec.yaml").write_text(text)
        command = [
            sys.executable,
            "-c",
            "from sweep.cli import main; main()",
            "view",
            "spec.yaml",
            "--no-open",
        ]
        server = subprocess.Popen(
            command,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        with server:
            try:
                assert server.stdout
                yield server.stdout.readline().strip()
            finally:
                server.terminate()


def measured(browser: Browser, n: int, seconds: float) -> dict[str, float]:
    """Frames drawn and received a second, steps a second,
    and ms of script for a frame.
    """
    with served(spec(n)) as address:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.goto(address)
        while not page.evaluate("Boolean(window.boidsweep?.view.stage.frame)"):
            page.wait_for_timeout(100)
        found: dict[str, float] = page.evaluate(MEASURE, seconds)
        page.close()
    return found


def page(scale: Scale = FULL) -> None:
    """Frames of runs at 60 steps a second."""
    with running_browser() as browser:
        for n, wanted in WANTED.items():
            found = measured(browser, n, scale.share * SECONDS)
            shown = (
                f"{found['drawn']:5.1f} frames/s drawn (wanted {wanted}),"
                f" {found['received']:5.1f} received"
            )
            print(
                f"page: {n:6,} boids: {shown}, {found['steps']:5.1f} steps/s,"
                f" {found['busy']:4.1f} ms of script each"
            )
