"""The demos of the start page: specs that lie beside this file, each with its title, a
sentence, and how it is shown.

Their moving pictures are runs of these specs, flown when a start page asks for them.
"""

import base64
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

from sweep.own_code.reading import load_spec
from sweep.web.live import Live
from sweep.web.protocol import Reply
from sweep.web.state import from_study

FOLDER = Path(__file__).parent / "demos"


@dataclass(frozen=True)
class Demo:
    """A spec that is worth a look.

    name      its file in FOLDER, without the ending
    title     what is seen, in a few words
    sentence  what to look for
    speed     steps a second at which it is opened
    overlays  what is drawn with it: some of those of a page
    beside    another preset, which is shown beside it; or ""
    first     the step at which its moving picture begins
    every     steps between two frames of this picture
    frames    how many frames it has
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
        """The spec."""
        return (FOLDER / f"{self.name}.yaml").read_text(encoding="utf-8")

    def shown(self) -> Live:
        """Its run, at the first step."""
        return Live(from_study(load_spec(FOLDER / f"{self.name}.yaml", code=False)))

    def entry(self) -> Reply:
        """What the start page says of it, and what it opens."""
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
            sentence="Each boid follows three rules about its neighbours, and nobody"
            " leads.",
            speed=60,
            overlays=(),
            first=300,
            every=3,
            frames=90,
        ),
        Demo(
            name="cafeteria",
            title="Cover a cafeteria",
            sentence="A hundred boids wander round two tables; the floor that they have"
            " visited is coloured.",
            speed=60,
            overlays=("trails", "coverage"),
            first=0,
            every=4,
            frames=90,
        ),
        Demo(
            name="crowd",
            title="One weight too strong",
            sentence="In the same cafeteria boids that pull together too much crowd in"
            " one place.",
            speed=60,
            overlays=("trails", "coverage"),
            first=0,
            every=4,
            frames=90,
        ),
        Demo(
            name="maze",
            title="Through the maze",
            sentence="Ten robots flock round six walls to their goal.",
            speed=30,
            overlays=("trails",),
            first=0,
            every=2,
            frames=90,
        ),
        Demo(
            name="text",
            title="What the paper says, what its program did",
            sentence="By the equations of the paper the flock bursts; beside it, on the"
            " same clock and seed, are the flocks of its program.",
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
            sentence="Each flock has a colour of its own, until it meets another one.",
            speed=60,
            overlays=("flocks",),
            first=150,
            every=6,
            frames=60,
        ),
    )
}
"""In the order of the page."""
PICTURED = ("flocks",)
"""Overlays that the server adds to a frame of a moving picture. The page draws trails
itself, and visits would be many times as large as the boids.
"""


@cache
def moving(name: str) -> Reply:
    """The moving picture of a demo: its scene, and its frames in base64."""
    demo = DEMOS[name]
    show = demo.shown()
    show.draw(tuple(one for one in demo.overlays if one in PICTURED))
    frames = []
    for frame in range(demo.frames):
        _fly(show, demo.first + frame * demo.every)
        frames.append(base64.b64encode(show.picture()).decode())
    return {"scene": show.scene(), "frames": frames}


def _fly(show: Live, step: int) -> None:
    """Take steps up to `step`, one by one as the page does."""
    show.take_steps(step - show.step)
    while show.going:
        show.advance(step - show.step)
