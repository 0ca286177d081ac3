"""The explorer in a notebook: what its widget answers, and its page in a real browser,
whose words reach a real widget.
"""

import base64
import io
import json
import queue
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page

import sweep
from sweep.errors import ChoiceError, StoreError
from sweep.explorer.site import site_of
from sweep.explorer.watching import Watched
from sweep.explorer.widget import MOST_LINES, Explored
from sweep.tables.stored_study import StoredStudy
from tests import plotted
from tests.web.chromium import PATIENCE

Said = list[dict[str, Any]]


@pytest.fixture(scope="module")
def results() -> Path:
    plotted.study("grid")
    folder = plotted.study("small").store.folder.parent
    assert isinstance(folder, Path)
    return folder


@pytest.fixture
def begun() -> Iterator[Callable[..., "FrontEnd"]]:
    """Attaches front ends, and closes their widgets."""
    widgets: list[Explored] = []

    def attached(widget: Explored) -> FrontEnd:
        widgets.append(widget)
        return FrontEnd(widget)

    yield attached
    for widget in widgets:
        widget.close()
    names = [thread.name for thread in threading.enumerate()]
    assert "boidsweep explorer" not in names


class FrontEnd:
    """What a front end sees of a widget."""

    def __init__(self, widget: Explored) -> None:
        self.widget = widget
        self.told: queue.Queue[tuple[dict[str, Any], bytes]] = queue.Queue()
        widget.send = self.receive

    def receive(
        self, content: dict[str, Any], buffers: list[bytes] | None = None
    ) -> None:
        plain = json.loads(json.dumps(content, allow_nan=False))
        self.told.put((plain, buffers[0] if buffers else b""))

    def say(self, **message: Any) -> None:
        """As the comm calls the widget when a message comes."""
        self.widget._handle_custom_msg(message, [])

    def until(self, found: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """The next message for which this is true."""
        deadline = time.monotonic() + PATIENCE
        while True:
            said, _ = self.told.get(timeout=deadline - time.monotonic())
            if found(said):
                return said

    def answer(self, question: str, *query: list[str]) -> dict[str, Any]:
        """What is answered to a question: an answer, or a refusal."""
        self.say(type="ask", id="q", question=question, query=list(query))
        assert self.until(lambda said: said.get("id") == "q")["type"] == "heard"
        return self.until(lambda said: said.get("id") == "q")


Begun = Callable[[Explored], FrontEnd]


def test_it_answers_what_the_server_of_sweep_show_answers(
    results: Path, begun: Begun
) -> None:
    page = begun(sweep.show("small", results))
    served = site_of(Watched(results)).questions
    for question, query in (
        ("studies", []),
        ("state", [["study", "small"]]),
        ("figure", [["study", "grid"], ["metric", "speed"]]),
        ("points", [["study", "small"], ["where", "separation_weight=1"]]),
        ("launch", []),
    ):
        said = page.answer(question, *query)
        pairs = [(name, value) for name, value in query]
        assert said["answer"] == json.loads(json.dumps(served[question](pairs)))


@pytest.mark.parametrize(
    ("question", "query", "why"),
    [
        ("fly", [], "the question is unknown"),
        ("state", [], 'the question lacks the key "study"'),
        ("state", [["study", "smal"]], "smal"),
        ("state", [["study", "../up"]], "not allowed"),
        ("figure", [["study", "small"], ["metric", "sped"]], 'did you mean "speed"'),
    ],
)
def test_a_refusal_is_one_sentence(
    results: Path, begun: Begun, question: str, query: list[list[str]], why: str
) -> None:
    said = begun(sweep.show("small", results)).answer(question, *query)
    assert said["type"] == "refusal"
    assert why in said["why"]
    assert "\n" not in said["why"]


def test_nonsense_from_a_front_end_is_refused_and_harms_nobody(
    results: Path, begun: Begun
) -> None:
    page = begun(sweep.show("small", results))
    for nonsense in (
        {"type": "fly"},
        {"type": "ask"},
        {"type": "ask", "question": "studies", "query": [["study"]]},
        {"type": "ask", "question": "studies", "query": [["study", 1]]},
        {"type": "ask", "question": ["studies"], "query": []},
        {"type": "open", "line": 3},
        {"type": "say", "line": "a"},
    ):
        page.say(id="n", **nonsense)
        said = page.until(lambda said: said["type"] == "refusal")
        assert said == {
            "type": "refusal",
            "id": "n",
            "why": "the message is not valid",
        }
    page.say(type="ask", question="studies", query=[])  # no id: nobody to answer
    page.widget._handle_custom_msg("nonsense", [])
    page.say(id="n", type="say", line="unknown", text="{}")
    assert page.answer("studies")["type"] == "answer"


def test_a_line_plays_a_stored_trial_and_an_unknown_one_ends_with_a_reason(
    results: Path, begun: Begun
) -> None:
    study = StoredStudy("small", results)
    trial = str(study.trials["trial_id"][0])
    page = begun(sweep.show(sweep.load("small", results)))
    hello = {"type": "hello", "page": "one", "study": "small", "trial": trial}
    page.say(id="1", type="open", line="a")
    page.say(id="2", type="say", line="a", text=json.dumps(hello))
    state = page.until(
        lambda said: said["type"] == "told" and said["message"]["type"] == "state"
    )
    assert state["line"] == "a"
    assert state["message"]["replay"]["equal"] is True
    page.until(lambda said: said["type"] == "frame")
    page.say(id="3", type="close", line="a")
    page.say(id="4", type="open", line="b")
    wrong = json.dumps(hello | {"page": "two", "trial": "zzz"})
    page.say(id="5", type="say", line="b", text=wrong)
    over = page.until(lambda said: said["type"] == "over")
    assert over["line"] == "b"
    page.say(id="6", type="open", line="c")
    page.say(
        id="7", type="say", line="c", text=json.dumps({"type": "hello", "page": "x"})
    )
    error = page.until(lambda said: said.get("line") == "c")
    assert "sweep.view has the simulator" in error["message"]["message"]


def test_lines_that_are_never_closed_are_limited(results: Path, begun: Begun) -> None:
    page = begun(sweep.show("small", results))
    for number in range(MOST_LINES + 1):
        page.say(id=str(number), type="open", line=str(number))
    assert page.until(lambda said: said["type"] == "refusal")["id"] == str(MOST_LINES)


def test_a_mistake_is_said_at_once(results: Path) -> None:
    with pytest.raises(StoreError, match="smal"):
        sweep.show("smal", results)
    with pytest.raises(ChoiceError, match="not allowed"):
        sweep.show("../up", results)
    with pytest.raises(ChoiceError, match="only whole studies"):
        sweep.show(sweep.load("small", results).where(separation_weight=1))


def test_without_a_front_end_there_is_the_first_figure_and_no_thread(
    results: Path,
) -> None:
    widget = sweep.show("grid", results)
    data, _ = widget._repr_mimebundle_()
    with Image.open(io.BytesIO(base64.b64decode(data["image/png"]))) as image:
        assert image.info["Study"] == "grid"
        assert image.size[0] > 400
    assert "application/vnd.jupyter.widget-view+json" in data
    assert widget._desk is None
    widget.close()
    studies = sweep.show(results=results)
    data, _ = studies._repr_mimebundle_()
    assert "image/png" not in data
    studies.close()


CELL = """<!doctype html><title>a notebook</title>
<body data-jp-theme-light="false"><div id="cell"></div>
<script type="module">
  const url = URL.createObjectURL(new Blob([ESM], { type: "text/javascript" }));
  const { default: widget } = await import(url);
  const listeners = [];
  window.sent = [];
  window.listeners = listeners;
  const model = {
    get: (name) => ({ page: PAGE, begin: BEGIN })[name],
    on: (event, act) => listeners.push([event, act]),
    off: (event, act) => {
      listeners.splice(listeners.findIndex(([, one]) => one === act), 1);
    },
    send: (message) => sent.push(message),
  };
  window.happens = (event, ...about) => {
    listeners.filter(([one]) => one === event).forEach(([, act]) => act(...about));
  };
  window.tell = (message, frame) => {
    const bytes = Uint8Array.from(atob(frame), (letter) => letter.charCodeAt(0));
    happens("msg:custom", message, frame ? [new DataView(bytes.buffer)] : []);
  };
  window.cleanup = widget.render({ model, el: document.querySelector("#cell") });
  window.loaded = true;
</script>"""


class Cell:
    """A cell of a notebook that shows a widget, in a browser."""

    def __init__(self, browser: Browser, front_end: FrontEnd, folder: Path) -> None:
        self.front_end, widget = front_end, front_end.widget
        text = CELL
        for name, value in (
            ("ESM", widget._esm),
            ("PAGE", widget.page),
            ("BEGIN", widget.begin),
        ):
            text = text.replace(name, json.dumps(value).replace("</", "<\\/"), 1)
        (folder / "cell.html").write_text(text)
        self.page: Page = browser.new_page(viewport={"width": 1200, "height": 950})
        self.wrong: list[str] = []
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on(
            "console",
            lambda said: self.wrong.append(said.text) if said.type == "error" else None,
        )
        self.page.goto((folder / "cell.html").as_uri())
        self.page.wait_for_function("window.loaded")
        self.frame = self.page.frame_locator("iframe")

    def carry(self) -> None:
        """Carry what both sides have said."""
        for message in self.page.evaluate("sent.splice(0)"):
            self.front_end.say(**message)
        while not self.front_end.told.empty():
            message, frame = self.front_end.told.get()
            data = base64.b64encode(frame).decode()
            self.page.evaluate("([said, data]) => tell(said, data)", [message, data])

    def seen(self, selector: str) -> Any:
        """Carry until something is there, and return it."""
        found = self.frame.locator(selector).first
        deadline = time.monotonic() + PATIENCE
        while not found.is_visible():
            assert time.monotonic() < deadline, selector
            self.carry()
            self.page.wait_for_timeout(20)
        return found


def test_a_tour_from_the_figure_to_a_trial_that_plays(
    browser: Browser, results: Path, begun: Begun, tmp_path: Path
) -> None:
    cell = Cell(browser, begun(sweep.show("small", results)), tmp_path)
    cell.seen(".figure .board")
    counts = cell.frame.locator(".counts").inner_text()
    assert "6 trials at 2 points: 6 done." in counts
    dark = "getComputedStyle(document.querySelector('.card')).backgroundColor"
    inner = next(one for one in cell.page.frames if one.parent_frame)
    assert inner.evaluate(dark) == "rgb(22, 28, 36)"
    cell.seen("[aria-label=points] tbody button").click()
    cell.seen("[aria-label=trials] tbody button").click()
    words = cell.seen(".player .record .exact").inner_text()
    assert words == "Every number equals the stored one, bit for bit."
    assert cell.page.url.startswith("file:")
    assert "#" not in cell.page.url
    assert inner.url.startswith("about:srcdoc#study=small&point=")
    assert not cell.frame.get_by_role("link", name="in the simulator").is_visible()
    cell.frame.locator("summary", has_text="Refine here").click()
    cell.seen(".refine .primary:disabled")
    cell.frame.get_by_role("link", name="Studies", exact=True).click()
    cell.seen("[aria-label=studies] tbody button")
    assert "about:srcdoc" in inner.url
    cell.page.evaluate("happens('comm_live_update')")
    cell.frame.get_by_text("kernel of these results has stopped").first.wait_for()
    cell.page.evaluate("cleanup()")
    assert cell.page.evaluate("[listeners.length, frames.length]") == [0, 0]
    cell.page.close()
    assert cell.wrong == []


def test_a_frame_that_is_moved_goes_on_where_it_was(
    browser: Browser, results: Path, begun: Begun, tmp_path: Path
) -> None:
    """A frame that a notebook takes out of its page and puts back loads anew."""
    cell = Cell(browser, begun(sweep.show(results=results)), tmp_path)
    cell.seen("[aria-label=studies] tbody button")
    cell.frame.get_by_role("button", name="grid", exact=True).click()
    cell.seen(".figure canvas")
    cell.page.evaluate(
        """() => {
          const frame = document.querySelector("iframe");
          const cell = frame.parentElement;
          frame.remove();
          cell.append(frame);
        }"""
    )
    cell.seen(".figure canvas")
    assert cell.frame.locator("h1").first.inner_text() == "grid"
    cell.page.close()
    assert cell.wrong == []


def test_a_busy_kernel_is_said_until_it_answers(
    browser: Browser, results: Path, begun: Begun, tmp_path: Path
) -> None:
    cell = Cell(browser, begun(sweep.show("small", results)), tmp_path)
    cell.frame.get_by_text("Waiting for the kernel").wait_for()
    cell.seen(".figure .board")
    assert not cell.frame.get_by_text("Waiting for the kernel").is_visible()
    cell.page.close()
    assert cell.wrong == []
