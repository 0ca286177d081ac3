"""What files of one's own say of themselves is text on the page, whatever it looks
like: they may be anyone's.
"""

import base64
import json
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Browser

from sweep.own_code.reading import load_spec
from sweep.web.filing import untold
from sweep.web.live_show import Live
from sweep.web.state import from_study
from tests import ROOT
from tests.oscillators import SPEC
from tests.patience import PATIENCE
from tests.web.chromium import Opened, running_server

EVIL = '</script><script>hacked = 1</script><img src=x onerror="hacked = 1">\'{}'
"""With the name of the place where it stands."""
PLACES = {
    "source": ('"Y. Kuramoto (1975), on boids"', "{}"),
    "setting": ('"pull of the phases of others"', "{}"),
    "choice": (
        'pacemakers: Annotated[int, About("boids that listen to nobody", low=0)]',
        'pacemakers: Annotated[int, About("few or many", choices=({}, "b"))]',
    ),
    "default": ('"pacemakers": 3', '"pacemakers": {}'),
    "kind": ('"pacemaker"', "{}"),
    "metric": ('"order of the phases of followers"', "{}"),
    "preset": ('"as_run":', "{}:"),
    "unit": ("    begin_state=begin_state,", "    begin_state=begin_state, length={},"),
}
"""What stands in the file of a model, and what a stranger writes there."""
MAPS = """
import numpy as np
from kernels.worlds import Map

def draw(settings, rng):
    return np.zeros((0, 5))

MAPS = {{"plain": Map(draw, {text!r}, {text!r})}}
"""


def written(folder: Path) -> Path:
    """A spec with a model, a metric and a map, all of whose texts are evil."""
    text = (ROOT / "tests" / "oscillators.py").read_text()
    for place, (old, new) in PLACES.items():
        assert old in text
        said = EVIL.format("choice" if place == "default" else place)
        text = text.replace(old, new.format(repr(said)))
    (folder / "circles.py").write_text(text + '\nMETRICS = {"order": ORDER}\n')
    (folder / "plain.py").write_text(MAPS.format(text=EVIL.format("map")))
    spec = SPEC.replace("model: oscillators", "model: ./circles.py")
    spec = spec.replace("metrics: [order]", "metrics: [./circles.py]")
    spec = spec.replace("preset: as_run", f"preset: {yaml(EVIL.format('preset'))}")
    spec = spec.replace("{steps: 9}", "{steps: 9, map: ./plain.py}")
    (folder / "spec.yaml").write_text(spec)
    return folder / "spec.yaml"


def yaml(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


STRANGE = """() => {
  const found = [];
  for (const one of document.querySelectorAll("*")) {
    const strange = one.tagName === "IMG" || one.hasAttribute("onerror");
    if (strange || (one.tagName === "SCRIPT" && one.text.startsWith("hacked"))) {
      found.push(one.outerHTML);
    }
  }
  return found;
}"""
"""The elements that are made of the texts."""
SEEN = """() => {
  const found = [];
  for (const one of document.querySelectorAll("body *:not(script)")) {
    found.push(...[...one.attributes].map((attribute) => attribute.value));
    found.push(...[...one.childNodes].filter((node) => node.nodeType === 3)
      .map((node) => node.data));
  }
  return found.join("\\n");
}"""
"""All texts and values of attributes, as the page has them."""


def test_texts_of_own_files_never_become_elements(
    opened: Callable[..., Opened], browser: Browser, tmp_path: Path
) -> None:
    """Neither on the live page, nor in the page that a run is saved as."""
    state = from_study(load_spec(written(tmp_path)))
    with running_server(lambda: Live(state)) as server:
        page = opened(server)
        page.page.get_by_role("button", name="Choose metrics").click()
        page.until(f"({SEEN})().includes({json.dumps(EVIL.format('metric'))})")
        page.until("boidsweep.view.overlays.legends.get('kinds').textContent")
        seen = str(page.ask(SEEN))
        places = {*PLACES, "map"} - {"default"}
        assert {one for one in places if EVIL.format(one) not in seen} == set()
        assert page.ask(STRANGE) == []
        assert page.ask("window.hacked") is None
        page.send(type="step", count=5)
        page.until("boidsweep.view.stage.frame.step === 5")
        saved = page.show.export("html")(untold)
        path = tmp_path / "flight.html"
        path.write_bytes(base64.b64decode(saved["data"]))
        offline = browser.new_page()
        offline.goto(path.as_uri())
        offline.get_by_text("step 0 of 5").first.wait_for(timeout=1000 * PATIENCE)
        assert offline.evaluate(STRANGE) == []
        assert offline.evaluate("window.hacked") is None
        offline.close()
