"""The notebook's widget: its messages as a front end has them, and its script in a real
browser.
"""

import base64
import io
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Browser

import sweep
from sweep.errors import ChoiceError, OutputError, SpecError
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import simulate
from sweep.web.live_show import Live
from sweep.web.widget import View
from tests.patience import PATIENCE
from tests.studies import SMALL, launched


class FrontEnd:
    """What a front end sees of a widget: the messages that are sent to it, and it says
    what a page would.
    """

    def __init__(self, view: View) -> None:
        self.view = view
        self.messages: list[dict[str, Any]] = []
        self.frames: list[bytes] = []
        self.more = threading.Condition()
        view.send = self.receive

    def receive(
        self, content: dict[str, Any], buffers: list[bytes] | None = None
    ) -> None:
        with self.more:
            if buffers:
                assert content == {"type": "frame"}
                self.frames += buffers
            else:
                self.messages.append(json.loads(json.dumps(content, allow_nan=False)))
            self.more.notify_all()

    def say(self, **message: Any) -> None:
        """As the comm calls the widget when a message comes."""
        self.view._handle_custom_msg(message, [])

    def until(self, found: Callable[[], Any]) -> Any:
        """What `found` returns once it is true."""
        deadline = time.monotonic() + PATIENCE
        with self.more:
            while not found():
                assert self.more.wait(deadline - time.monotonic()), self.messages[-3:]
            return found()

    def last(self, kind: str) -> dict[str, Any] | None:
        return next(
            (message for message in reversed(self.messages) if message["type"] == kind),
            None,
        )


@pytest.fixture
def front_end() -> Iterator[Callable[[View], FrontEnd]]:
    """Attaches front ends, and closes their widgets."""
    views: list[View] = []

    def attached(view: View) -> FrontEnd:
        views.append(view)
        return FrontEnd(view)

    yield attached
    for view in views:
        view.close()
    assert not [
        thread for thread in threading.enumerate() if thread.name == "boidsweep view"
    ]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(SMALL, tmp_path_factory.mktemp("widget"))


def test_a_live_run_is_shown_and_steered_and_has_the_bits_of_its_spec(
    front_end: Callable[[View], FrontEnd],
) -> None:
    view = sweep.view(model="nguyen2024", n=12, steps=30, seed=7)
    page = front_end(view)
    page.say(type="hello", page="one")
    page.until(lambda: page.last("scene") and page.frames)
    assert page.last("state")["settings"]["n"] == 12
    page.say(type="speed", steps_per_second=0)
    page.say(type="run")
    page.until(lambda: page.last("state")["step"] == 30)
    page.say(type="ready")
    page.until(lambda: int.from_bytes(page.frames[-1][8:12], "little") == 30)
    result = simulate(view.show.state.job)
    assert result.trajectory is not None
    assert view.show.bodies.tobytes() == result.trajectory[-1].tobytes()
    page.say(type="set", name="separation_wieght", value=1)
    assert (
        'did you mean "separation_weight"'
        in page.until(lambda: page.last("error"))["message"]
    )


def test_a_widget_sends_no_second_frame_before_the_first_is_drawn(
    front_end: Callable[[View], FrontEnd],
) -> None:
    view = sweep.view(n=12, steps=30)
    page = front_end(view)
    page.say(type="hello", page="one")
    page.until(lambda: page.frames)
    page.say(type="ready")
    page.say(type="step", count=5)
    page.until(lambda: page.last("state")["step"] == 5 and len(page.frames) >= 2)
    count = len(page.frames)
    page.say(type="step", count=5)
    page.until(lambda: page.last("state")["step"] == 10)
    assert len(page.frames) == count


def test_nonsense_from_a_front_end_is_refused_and_harms_nobody(
    front_end: Callable[[View], FrontEnd],
) -> None:
    page = front_end(sweep.view(n=12, steps=30))
    for nonsense in (
        {"type": "fly"},
        {"no": "type"},
        {"type": "step", "count": -1},
        {"type": "undo"},
    ):
        before = len(page.messages)
        page.say(**nonsense)
        page.until(
            lambda before=before: any(
                one["type"] == "error" for one in page.messages[before:]
            )
        )
    page.say(type="step", count=2)
    page.until(lambda: page.last("state") and page.last("state")["step"] == 2)


def test_a_stored_trial_is_scrubbed_in_a_notebook(
    study: StoredStudy, front_end: Callable[[View], FrontEnd]
) -> None:
    trial = str(study.plan["trial_id"][2].as_py())
    page = front_end(sweep.replay(study, trial))
    page.say(type="hello", page="one")
    page.until(lambda: page.last("state") and page.frames)
    assert page.last("state")["replay"]["trial"] == trial
    assert page.last("state")["replay"]["equal"] is True
    page.say(type="seek", frame=6)
    page.say(type="ready")
    page.until(lambda: int.from_bytes(page.frames[-1][8:12], "little") == 6)
    assert page.view.spec.startswith(
        f"# the last of the 3 trials of this spec is {trial} of small\n"
    )


def test_without_a_front_end_there_is_a_picture_and_no_thread() -> None:
    view = sweep.view(n=12, steps=30)
    data, _ = view._repr_mimebundle_()
    with Image.open(io.BytesIO(base64.b64decode(data["image/png"]))) as image:
        assert image.info["Model"] == "nguyen2024 as_run"
        assert image.size[0] > 400
    assert "application/vnd.jupyter.widget-view+json" in data
    assert view._line is None
    view.close()


def test_a_view_is_saved_as_each_kind_of_file(
    study: StoredStudy, tmp_path: Path
) -> None:
    view = sweep.replay(study, str(study.plan["trial_id"][2].as_py()))
    for kind in ("png", "svg", "gif", "html"):
        view.save(tmp_path / f"flight.{kind}")
    with Image.open(tmp_path / "flight.gif") as gif:
        assert gif.n_frames == 10
    assert b"</html>" in (tmp_path / "flight.html").read_bytes()
    with pytest.raises((ChoiceError, OutputError), match="exists already"):
        view.save(tmp_path / "flight.gif")
    with pytest.raises(
        (ChoiceError, OutputError),
        match=r'unknown kind of file "\.htm"; did you mean "\.html"',
    ):
        view.save(tmp_path / "flight.htm")
    view.close()


def test_a_changed_run_is_saved_as_a_picture_only(
    tmp_path: Path, front_end: Callable[[View], FrontEnd]
) -> None:
    view = sweep.view(n=12, steps=30)
    page = front_end(view)
    page.say(type="step", count=4)
    page.until(lambda: page.last("state") and page.last("state")["step"] == 4)
    page.say(type="set", name="separation_weight", value=2)
    page.until(lambda: not page.last("state")["exact"])
    with pytest.raises(
        SpecError, match="the run of the spec, but separation_weight changed"
    ):
        view.save(tmp_path / "x.gif")
    view.save(tmp_path / "x.png")
    assert [path.name for path in tmp_path.iterdir()] == ["x.png"]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"model": "nguyen2025"},
            '^unknown model "nguyen2025"; did you mean "nguyen2024"',
        ),
        ({"preset": "as_runn"}, 'did you mean "as_run"'),
        ({"cohesion_wieght": 1}, 'did you mean "cohesion_weight"'),
        ({"n": -3}, "^-3 is not allowed for n"),
    ],
)
def test_a_mistake_is_said_at_once(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(SpecError, match=message):
        sweep.view(**wrong)


def test_the_functions_bring_nothing_along_before_they_are_called() -> None:
    code = "import sweep, sys; assert 'sweep.web' not in sys.modules; "
    code += (
        "import sweep.web.state; assert callable(sweep.view) and callable(sweep.replay)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE)


MIDDLE = """(() => {
  const canvas = document.querySelector("canvas");
  const [x, y] = [canvas.width / 2, canvas.height / 2];
  const { data } = canvas.getContext("2d").getImageData(x, y, 1, 1);
  return [...data];
})()"""
DARK_GROUND = [18, 23, 30, 255]
PAGE = """<!doctype html><title>a notebook</title>
<body data-jp-theme-light="false"><div id="cell"></div>
<script type="module">
  const url = URL.createObjectURL(new Blob([ESM], { type: "text/javascript" }));
  const { default: widget } = await import(url);
  const listeners = [];
  window.sent = [];
  window.model = {
    on: (event, act) => listeners.push([event, act]),
    off: (event, act) => {
      listeners.splice(listeners.findIndex(([, one]) => one === act), 1);
    },
    send: (message) => sent.push(message),
  };
  window.listeners = listeners;
  window.happens = (event, ...about) => {
    listeners.filter(([one]) => one === event).forEach(([, act]) => act(...about));
  };
  window.tell = (message, frame) => {
    const code = (letter) => letter.charCodeAt(0);
    const bytes = (text) => Uint8Array.from(atob(text), code);
    const buffers = frame ? [new DataView(bytes(frame).buffer)] : [];
    happens("msg:custom", message, buffers);
  };
  const el = document.createElement("div"); // which a notebook attaches only later
  window.cleanup = widget.render({ model, el });
  window.attach = () => document.querySelector("#cell").append(el);
  window.loaded = true;
</script>"""


@pytest.mark.smoke
def test_its_script_draws_in_a_cell_and_leaves_nothing_behind(
    browser: Browser, tmp_path: Path
) -> None:
    """By the interface of anywidget: a module with render({model, el}), whose buffers
    are DataViews.
    """
    view = sweep.view(n=12, steps=30, map="empty")
    (tmp_path / "cell.html").write_text(
        PAGE.replace("ESM", json.dumps(view._esm).replace("</", "<\\/"))
    )
    page = browser.new_page(viewport={"width": 900, "height": 900})
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto((tmp_path / "cell.html").as_uri())
    page.wait_for_function("window.loaded")
    page.add_style_tag(content=view._css)
    page.evaluate("attach()")
    page.wait_for_function("sent.length")
    assert page.evaluate("sent.map(({ type }) => type)") == ["hello"]
    page.get_by_text("Waiting for the kernel").wait_for()  # which answers late
    show = Live(view.show.state)
    for reply in show.greeting():
        page.evaluate("message => tell(message)", reply)
    page.evaluate(
        "frame => tell({ type: 'frame' }, frame)",
        base64.b64encode(show.picture()).decode(),
    )
    page.wait_for_function("sent.some(({ type }) => type === 'ready')")
    assert page.evaluate(MIDDLE) == DARK_GROUND
    assert not page.get_by_text("Waiting for the kernel").is_visible()
    page.get_by_role("button", name="Run (Space)").click()
    page.wait_for_function("sent.some(({ type }) => type === 'run')")
    assert page.locator("canvas").first.bounding_box()["height"] > 200
    page.evaluate("happens('comm_live_update')")
    page.get_by_text("The kernel of this run has stopped.").wait_for()
    page.get_by_label("the swarm in a world").press("Space")
    assert page.evaluate("sent.map(({ type }) => type)").count("run") == 1
    page.evaluate("cleanup()")
    assert page.evaluate(
        "[listeners.length, document.querySelector('#cell > div').childElementCount]"
    ) == [0, 0]
    page.close()
    view.close()
    assert wrong == []
