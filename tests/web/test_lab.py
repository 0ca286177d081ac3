"""The notebook's widget where it lives: in a JupyterLab, driven by a browser, with a
kernel behind it.
"""

import base64
import io
import json
import time
from collections.abc import Callable, Iterator
from hashlib import sha256

import nbformat
import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser

import sweep
from tests.attacks.hostile import give, give_plan
from tests.studies import SMALL, launched
from tests.web.chromium import PATIENCE
from tests.web.lab import NOTEBOOK, Lab, Notebook, running_lab

pytestmark = pytest.mark.slow

Open = Callable[..., Notebook]

SHOWN = (
    "import sweep\nview = sweep.view(model='nguyen2024', n=40, seed=7, steps=400)\nview"
)
ITS_STATE = """import json, hashlib
bodies = hashlib.sha256(view.show.bodies.tobytes()).hexdigest()
shown = {"step": view.show.step, "exact": view.show.exact, "spec": view.spec}
print(json.dumps(shown | {"bodies": bodies}))"""
FLOWN = SMALL.replace("every: 2", "every: 3, trajectories: true")

COLOURS = """(part) => {
  const canvas = document.querySelector(`.boidsweep ${part} > canvas`);
  const { width, height } = canvas;
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const counts = {};
  for (let i = 0; i < data.length; i += 4) {
    const colour = data.slice(i, i + 3).join(" ");
    counts[colour] = (counts[colour] ?? 0) + data[i + 3] / 255;
  }
  return counts;
}"""
"""How many pixels of a part of the view have which colour."""
LIGHT = {"ground": "255 255 255", "boid": "0 114 178"}
DARK = {"ground": "18 23 30", "boid": "86 180 233"}

PARTS = [
    ".picture > canvas",
    ".pickers select",
    ".group summary",
    ".field input[type=range]",
    ".going",
]
KEYS = [
    "d",
    "d",
    ".",
    "Space",
    "x",
    "a",
    "b",
    "m",
    "r",
    "y",
    "z",
    "j",
    "k",
    "0",
    "0",
    "i",
    "i",
    "ArrowDown",
    "Escape",
]
KEYS += [
    "Delete",
    "Enter",
    "Shift+Enter",
    "Control+Enter",
    "Alt+Enter",
    "Shift+m",
    "Control+x",
    "Control+z",
]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with running_lab(tmp_path_factory.mktemp("lab")) as lab:
        yield lab


@pytest.fixture
def opened(
    browser: Browser, lab: Lab, request: pytest.FixtureRequest
) -> Iterator[Open]:
    """Opens a notebook of these cells; afterwards it sees that nothing went wrong in
    its page.
    """
    notebooks: list[Notebook] = []

    def opened(*cells: str) -> Notebook:
        notebooks.append(
            Notebook(browser, lab, f"{request.node.name}.ipynb", list(cells))
        )
        return notebooks[-1]

    yield opened
    for notebook in notebooks:
        notebook.use_theme("JupyterLab Light")
        notebook.page.evaluate(f"{NOTEBOOK}.sessionContext.shutdown()")
        notebook.page.close()
    assert [
        complaint for notebook in notebooks for complaint in notebook.complaints
    ] == []


def shown(opened: Open, *cells: str) -> Notebook:
    """A notebook whose first cell has been run and shows a live run."""
    notebook = opened(SHOWN, *cells)
    notebook.run(0)
    notebook.until_step(0)
    return notebook


def begin(notebook: Notebook, step: int = 20) -> None:
    """Press Run and wait for a step."""
    notebook.view.get_by_role("button", name="Run (Space)").click()
    notebook.until_step(step)


def is_in(notebook: Notebook, colours: dict[str, str]) -> bool:
    """Whether most of the world has the colour of the ground, and boids and curves have
    theirs.
    """
    world, plot = (
        notebook.page.evaluate(COLOURS, part) for part in (".picture", ".plot")
    )
    ground, boid = colours["ground"], colours["boid"]
    return bool(
        world.get(ground, 0) > 50_000
        and world.get(boid, 0) > 40 * 20
        and plot.get(boid, 0) > 0
    )


def until_in(notebook: Notebook, colours: dict[str, str]) -> None:
    """Wait until it is drawn in these colours."""
    deadline = time.monotonic() + PATIENCE
    while not is_in(notebook, colours):
        assert time.monotonic() < deadline
        notebook.page.wait_for_timeout(100)


def test_a_live_run_is_steered_and_its_spec_gives_what_is_on_the_screen(
    opened: Open, lab: Lab
) -> None:
    notebook = shown(
        opened, ITS_STATE, "study = sweep.run(view.spec, workers=1)\nprint(study.name)"
    )
    view = notebook.view
    ground = notebook.page.evaluate(COLOURS, ".picture").get(LIGHT["ground"], 0)
    assert ground > 50_000
    room, box = (
        view.locator("xpath=..").bounding_box(),
        view.locator(".layout").bounding_box(),
    )
    assert room is not None
    assert box == room
    view.get_by_label("cohesion weight", exact=True).fill("0.4")
    view.get_by_label("cohesion weight", exact=True).press("Enter")
    view.get_by_label("n, slider", exact=True).press("ArrowRight")
    notebook.until_words("count", "1 changed")
    begin(notebook, 30)
    view.get_by_role("button", name="Pause").click()
    view.get_by_role("button", name="Run (Space)").wait_for()
    told = json.loads(notebook.said(1))
    assert told["step"] == notebook.until_step(told["step"])
    assert told["exact"]
    assert "cohesion_weight: 0.4" in told["spec"]
    assert "n: 40," not in told["spec"]
    study = sweep.load(notebook.said(2).strip(), lab.folder / "results")
    frames, bodies = study.trajectory(study.trials["trial_id"][0])
    assert frames[told["step"]] == told["step"] >= 30
    assert sha256(bodies[told["step"]].tobytes()).hexdigest() == told["bodies"]


def test_a_stored_trial_is_scrubbed_and_has_the_stored_numbers(
    opened: Open, lab: Lab
) -> None:
    study = launched(FLOWN, lab.folder / "stored")
    row = study.trials.iloc[2]
    call = (
        "import sweep\nstudy = sweep.load('small', 'stored')\n"
        f"view = sweep.replay(study, '{row['trial_id']}')\nview"
    )
    notebook = opened(
        call, ITS_STATE, "print(json.dumps(view.show.status()['replay']['metrics']))"
    )
    notebook.run(0)
    notebook.until_words("record", "Every number equals the stored one, bit for bit.")
    notebook.view.get_by_label("step", exact=True).fill("6")
    assert notebook.until_step(6) == 6
    told = json.loads(notebook.said(1))
    frames, bodies = study.trajectory(row["trial_id"])
    (stored,) = bodies[np.flatnonzero(frames == 6)]
    assert (told["step"], told["bodies"]) == (6, sha256(stored.tobytes()).hexdigest())
    metrics = json.loads(notebook.said(2))
    assert metrics == {
        name: {"stored": row[name], "replayed": row[name]} for name in study.metrics
    }
    cells = [
        cell.split("\t")
        for cell in notebook.view.locator(".record tbody tr").all_inner_texts()
    ]
    for name, stored, replayed in cells:
        assert (
            float(stored)
            == float(replayed)
            == pytest.approx(row[name.replace(" ", "_")], rel=1e-5)
        )
    assert len(cells) == len(study.metrics)


def test_keys_that_are_meant_for_the_view_do_nothing_to_the_notebook(
    opened: Open,
) -> None:
    notebook = shown(opened, "1 + 1", "2 + 2")
    cells = notebook.cells
    for part in PARTS:
        for key in KEYS:
            notebook.view.locator(part).first.focus()
            notebook.page.keyboard.press(key)
            notebook.page.keyboard.press("Escape")  # from a dialog of the view
            assert notebook.cells == cells, (part, key)
    assert notebook.page.locator(".jp-Dialog").count() == 0
    assert notebook.view.count() == 1
    counts = notebook.page.evaluate(
        f"{NOTEBOOK}.content.widgets.map((one) => one.model.executionCount)"
    )
    assert counts == [1, None, None]
    notebook.page.keyboard.press("Control+s")
    notebook.until(f"!{NOTEBOOK}.context.model.dirty")


def test_it_follows_the_theme_of_jupyterlab(opened: Open) -> None:
    notebook = shown(opened)
    begin(notebook)
    notebook.view.get_by_role("button", name="Pause").click()
    notebook.view.get_by_role("button", name="Run (Space)").wait_for()
    until_in(notebook, LIGHT)
    for theme, colours in (("JupyterLab Dark", DARK), ("JupyterLab Light", LIGHT)):
        notebook.use_theme(theme)
        until_in(notebook, colours)


def test_a_saved_notebook_has_the_picture_of_the_frame(opened: Open) -> None:
    notebook = shown(opened)
    notebook.save()
    (output,) = nbformat.read(notebook.path, as_version=4).cells[0].outputs
    with Image.open(io.BytesIO(base64.b64decode(output.data["image/png"]))) as image:
        assert image.info["Model"] == "nguyen2024 as_run"
    from nbconvert import HTMLExporter

    page, _ = HTMLExporter().from_filename(str(notebook.path))
    assert output.data["image/png"][:60] in page


def test_a_run_that_is_gone_with_its_kernel_says_so_until_the_cell_is_run_again(
    opened: Open,
) -> None:
    notebook = shown(opened)
    begin(notebook)
    notebook.restart()
    notebook.until_words(
        "banner",
        "The kernel of this run has stopped. Run the cell again for a new run.",
    )
    notebook.until_words("going", "Run")
    last = notebook.until_step(0)
    notebook.view.locator(".going").click(force=True)
    notebook.view.locator(".picture > canvas").focus()
    notebook.page.keyboard.press("Space")
    assert notebook.view.locator(".going").inner_text() == "Run"
    assert notebook.until_step(0) == last
    notebook.until_idle()
    old = notebook.view.element_handle()
    notebook.run(0)
    # The view of the old run is shown a moment longer, and would take the press.
    notebook.page.wait_for_function("view => !view.isConnected", arg=old)
    notebook.until_step(0)
    begin(notebook)
    assert notebook.view.locator(".banner").is_hidden()


def test_a_stranger_s_texts_stay_texts(opened: Open, lab: Lab) -> None:
    """In the widget of a trial whose row, spec and study a stranger has written."""
    mark = '</script><img src=x onerror="window.hacked = 1"><b>bold</b>'
    study = launched(
        FLOWN.replace("study: small", "study: strange"), lab.folder / "strange"
    )
    folder = lab.folder / "strange" / study.name
    give(folder, error=mark, speed=0.25)
    give_plan(folder, {"spec": f"# {mark}\n{study.spec}", "spec_path": mark})
    call = (
        "import sweep\nstudy = sweep.load('strange', 'strange')\n"
        f"view = sweep.replay(study, '{study.plan['trial_id'][0].as_py()}')\nview"
    )
    notebook = opened(call, "print(repr(study.spec))", "study.trials[['error']]")
    notebook.run(0)
    notebook.until_words("record", "speed")
    notebook.view.get_by_label("step", exact=True).fill("3")
    assert notebook.until_step(3) == 3
    assert "onerror" in notebook.said(1)
    notebook.run(2)
    assert notebook.page.locator(".jp-OutputArea td", has_text="onerror").count() > 0
    assert notebook.page.evaluate("window.hacked") is None
    assert notebook.page.locator('img[src="x"]').count() == 0


def test_results_are_explored_in_a_cell_up_to_a_trial_that_plays(
    opened: Open, lab: Lab
) -> None:
    study = launched(FLOWN.replace("small", "explored"), lab.folder / "explored")
    call = "import sweep\nsweep.show('explored', 'explored')"
    notebook = opened(call, "1 + 1")
    address = notebook.page.url
    (output,) = notebook.run(0)
    with Image.open(io.BytesIO(base64.b64decode(output["data"]["image/png"]))) as image:
        assert image.info["Study"] == study.name
    frame = notebook.page.frame_locator("iframe[title='Results of boidsweep']")
    frame.locator(".figure .board").first.wait_for()
    frame.locator("[aria-label=points] tbody button").first.click()
    frame.locator("[aria-label=trials] tbody button").first.click()
    words = frame.locator(".player .record .exact")
    words.wait_for()
    assert words.inner_text() == "Every number equals the stored one, bit for bit."
    before = notebook.cells
    for key in ("d", "d", "x", "a", "b"):
        notebook.page.keyboard.press(key)
    assert notebook.cells == before
    assert notebook.page.url == address
    card = frame.locator(".card").first
    notebook.use_theme("JupyterLab Dark")
    frame.locator("[data-scheme=dark] .card, html[data-scheme=dark]").first.wait_for()
    words.wait_for()
    colour = "one => getComputedStyle(one).backgroundColor"
    assert card.evaluate(colour) == "rgb(22, 28, 36)"
    notebook.restart()
    frame.get_by_text("kernel of these results has stopped").first.wait_for()
    notebook.until_idle()
    notebook.run(0)
    frame.locator(".figure .board").first.wait_for()
