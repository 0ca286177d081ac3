"""The demos of the start page: specs next to this file, with title and sentence.

The animations are runs of the specs, simulated when a start page asks for animations
for the first time, and kept in the cache.
"""

import base64
import hashlib
import sys
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from kernels.identity import kernels_sha
from sweep.errors import CacheError, OutputError
from sweep.own_code import load_spec
from sweep.tables import unfinished
from sweep.trial import usual
from sweep.web import encoding
from sweep.web.live_show import Live
from sweep.web.protocol import Reply, write
from sweep.web.state import from_study

FOLDER = Path(__file__).parent / "demos"


@dataclass(frozen=True)
class Demo:
    """A spec for the start page.

    Attributes
    ----------
    name : str
        Name of the file in FOLDER, without the ending.
    title : str
        A title of a few words.
    sentence : str
        A sentence about what to look for.
    speed : float
        Speed of the opened demo, in steps per second.
    overlays : tuple of str
        Overlays of the opened demo.
    first : int
        First step of the animation.
    every : int
        Steps between two frames of the animation.
    frames : int
        Number of frames of the animation.
    beside : str, default ""
        A second preset, shown next to the first one, or "".
    """

    name: str
    title: str
    sentence: str
    speed: float
    overlays: tuple[str, ...]
    first: int
    every: int
    frames: int
    beside: str = ""

    @cached_property
    def text(self) -> str:
        """The YAML of the spec."""
        return (FOLDER / f"{self.name}.yaml").read_text(encoding="utf-8")

    def shown(self) -> Live:
        """Return the run of the demo, at the first step."""
        return Live(from_study(load_spec(FOLDER / f"{self.name}.yaml", code=False)))

    def entry(self) -> Reply:
        """Return the entry for the start page, with the spec to open."""
        return {
            "name": self.name,
            "title": self.title,
            "sentence": self.sentence,
            "yaml": self.text,
            "speed": self.speed,
            "overlays": list(self.overlays),
            "beside": self.beside,
        }


DEMOS = {
    demo.name: demo
    for demo in (
        Demo(
            name="flock",
            title="A flock",
            sentence="Each boid follows three rules about neighbours, and no boid"
            " leads. Colour is heading.",
            speed=60,
            overlays=("headings",),
            first=300,
            every=3,
            frames=90,
        ),
        Demo(
            name="cafeteria",
            title="Cover a cafeteria",
            sentence="A hundred boids wander round two tables. How much of the floor"
            " do they visit?",
            speed=60,
            overlays=("trails", "coverage"),
            first=0,
            every=4,
            frames=90,
        ),
        Demo(
            name="crowd",
            title="One weight too strong",
            sentence="In this cafeteria the cohesion is too strong, and the boids crowd"
            " together.",
            speed=60,
            overlays=("trails", "coverage"),
            first=0,
            every=4,
            frames=90,
        ),
        Demo(
            name="maze",
            title="Through the maze",
            sentence="Ten robots flock round six walls to the goal.",
            speed=30,
            overlays=("trails",),
            first=0,
            every=2,
            frames=90,
        ),
        Demo(
            name="text",
            title="A paper and its program",
            sentence="With the equations of the paper the flock bursts. The flocks of"
            " the program run next to it, with equal clock and seed.",
            speed=5,
            overlays=("trails",),
            first=0,
            every=1,
            frames=40,
            beside="as_run",
        ),
        Demo(
            name="thousand",
            title="A thousand boids",
            sentence="Each flock has a distinct colour, until two flocks meet.",
            speed=60,
            overlays=("flocks",),
            first=150,
            every=6,
            frames=60,
        ),
    )
}
"""The demos in the order of the page."""
PICTURED = ("flocks",)
"""Overlays that the server adds to a frame of an animation.

The page draws trails and colours of headings. Visits would be many times as large as
the boids.
"""


@cache
def kept(name: str) -> bytes:
    """Return the animation of a demo as JSON, from the cache of this user.

    The first line of the file is a hash of the origin of the animation. If the origin
    has changed, or the cache cannot be read, the demo is simulated.
    """
    origin = _origin(DEMOS[name])
    try:
        path = usual() / f"{name}.demo.json"
    except CacheError:
        return write(moving(name)).encode()
    with suppress(OSError):
        line, _, content = path.read_bytes().partition(b"\n")
        if line == origin:
            return content
    content = write(moving(name)).encode()
    with suppress(OutputError), unfinished(path, path.parents[1]) as file:
        file.write(origin + b"\n" + content)
    return content


def _origin(demo: Demo) -> bytes:
    """Return a hash of a demo, of the program and of the form of frames."""
    form = Path(encoding.__file__).read_text(encoding="utf-8")
    origin = demo, demo.text, sys.modules["sweep"].__version__, kernels_sha(), form
    return hashlib.sha256(repr(origin).encode()).hexdigest().encode()


def moving(name: str) -> Reply:
    """Return the animation of a demo: the scene, and the frames in base64."""
    demo = DEMOS[name]
    show = demo.shown()
    show.draw(tuple(name for name in demo.overlays if name in PICTURED))
    frames = []
    for frame in range(demo.frames):
        _run_to(show, demo.first + frame * demo.every)
        frames.append(base64.b64encode(show.picture()).decode())
    return {"scene": show.scene(), "frames": frames}


def _run_to(show: Live, step: int) -> None:
    """Take steps up to `step`, one by one like the page."""
    show.take_steps(step - show.step)
    while show.going:
        show.advance(step - show.step)
