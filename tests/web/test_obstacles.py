"""Obstacles on the page: of any shape, edited by hand, and moving."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from string import Template

import numpy as np
import pytest

from kernels.shapes import Polygon
from kernels.worlds import build_world, inside_obstacle
from sweep.trial.world import world_of
from sweep.web.page import STATIC
from sweep.web.scene import scene_of
from tests import builders
from tests.kernels.test_worlds import SETTINGS
from tests.web.chromium import Opened
from tests.web.scripts import printed

SCRIPT = Template("""
import { isSolid, obstaclesAt } from "$static/obstacles.js";
const { scenes, steps, places } = $given;
console.log(JSON.stringify({
  drawn: scenes.map((scene) => steps.map((step) => obstaclesAt(scene, step))),
  solid: scenes[0].obstacles.slice(1).map((row) =>
    places.map(([x, y]) => isSolid(row[5], { x, y }))
  ),
}));
""")
HALL = (20.0, 20.0), (280.0, 20.0), (280.0, 150.0), (150.0, 150.0), (20.0, 250.0)
TRIANGLE = (40.0, 40.0), (90.0, 60.0), (60.0, 90.0)
OBSTACLES = (
    (200.0, 50.0, 10.0, 10.0, 1.0, 3.0, -4.0),
    Polygon(HALL, is_arena=True),
    Polygon(TRIANGLE, velocity=(5.5, 7.0)),
)
Open = Callable[..., Opened]


def test_the_page_has_obstacles_where_kernels_have_them(tmp_path: Path) -> None:
    """Sums of the same numbers in the same order, but for what rounds to 15 digits."""
    jobs = [
        replace(
            builders.job(width=300, height=260, borders=borders, n=2),
            obstacles=OBSTACLES,
        )
        for borders in ("bounded", "torus", "open")
    ]
    steps, rng = [0, 1, 17, 1000], np.random.default_rng(3)
    places = rng.uniform(0, 300, (500, 2))
    given = {
        "scenes": [scene_of(job) for job in jobs],
        "steps": steps,
        "places": places.tolist(),
    }
    script = SCRIPT.substitute(static=STATIC.as_uri(), given=json.dumps(given))
    told = printed(script, tmp_path)
    for job, drawn in zip(jobs, told["drawn"], strict=True):
        for step, rows in zip(steps, drawn, strict=True):
            world = world_of(job).at(step)
            found = np.array([row[:5] for row in rows])
            np.testing.assert_allclose(found, world.obstacles, rtol=0, atol=1e-9)
            for number, polygon in world.polygons.items():
                vertices = rows[number][5]["vertices"]
                np.testing.assert_allclose(
                    vertices, polygon.vertices, rtol=0, atol=1e-9
                )
    world = build_world(SETTINGS._replace(width=300.0, height=260.0), OBSTACLES)
    for m, solid in enumerate(told["solid"], 1):
        assert solid == [inside_obstacle(world, m, x, y) for x, y in places.tolist()]


SHAPES = [
    {"polygon": {"vertices": [[100, 100], [700, 100], [700, 500], [100, 500]]}},
    {"polygon": {"vertices": [[300, 200], [500, 200], [400, 400]]}},
]
SHAPES[0]["polygon"] |= {"solid": "outside"}


@pytest.mark.parametrize("pixel", [(50, 300), (400, 250)])
def test_polygons_are_drawn_moved_and_written(
    opened: Open, pixel: tuple[int, int]
) -> None:
    page = opened()
    page.send(type="shapes", shapes=SHAPES)
    until = "boidsweep.view.stage.scene.obstacles.length === 2"
    page.until(f"{until} && !boidsweep.view.stage.edited")
    assert colour_at(page, pixel) != colour_at(page, (250, 450))
    page.page.keyboard.press("v")
    page.ask("boidsweep.view.hand.mark(1)")
    page.drag((400, 250), (450, 300))
    page.until(
        "JSON.stringify(boidsweep.view.stage.scene.obstacles[1][5].vertices) ==="
        " '[[350,250],[550,250],[450,450]]' && !boidsweep.view.stage.edited"
    )
    assert page.ask("boidsweep.view.stage.scene.obstacles[0][5].solid") == "outside"


def colour_at(page: Opened, place: tuple[int, int]) -> list[int]:
    """The colour of the picture at a place of the world, once it is drawn anew."""
    script = """([x, y]) => new Promise((done) => requestAnimationFrame(() => {
      const { stage } = boidsweep.view;
      stage.paint(stage.scene);
      const at = stage.toScreen({ x, y });
      const [left, top] = [at.x, at.y].map((one) => Math.round(one * stage.ratio));
      done([...stage.context.getImageData(left, top, 1, 1).data]);
    }))"""
    found: list[int] = page.page.evaluate(script, list(place))
    return found
