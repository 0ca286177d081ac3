"""What a page needs to tell from places alone whom a boid sees, who flocks together
and what was visited.
"""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.trial import looking
from sweep.trial.simulation import Simulation
from sweep.web.encoding import Floats
from sweep.web.protocol import plain
from sweep.web.running import simulation_of


def senses_of(job: Job, bodies: Floats) -> dict[str, Any]:
    """What the script of a recording reads besides the frames.

    job     the trial
    bodies  (F, 4, N): x, y, vx and vy of its frames

    `range`, `fov` in degrees and `inclusive` are those of the longest search of the
    model; with `shortest_way` distances are taken through the borders. `flock_range` is
    that of the metrics of flocks. `resting` has a bit for each boid of each frame, in
    base64: whether it sees all round, as it rests; "" where none does. With `measured`
    boids know what they measured and heard, which no frame has. `pixels` is null where
    no visits are counted.
    """
    simulation = simulation_of(job)
    sight = looking.sight(simulation)
    return {
        "range": plain(sight.range),
        "fov": sight.fov,
        "inclusive": sight.inclusive,
        "shortest_way": bool(simulation.world.minimum_image),
        "flock_range": float(job.settings["flock_range"]),
        "resting": "" if looking.faces_heading(simulation) else _resting(bodies),
        "measured": looking.is_measured(simulation),
        "pixels": _pixels(simulation),
    }


def faced(job: Job, bodies: Floats) -> Floats:
    """The bodies (F, 4, N), in which a boid that rests has the velocity that it last
    had, where it looks there. At first it looks along +x.
    """
    if not looking.faces_heading(simulation_of(job)):
        return bodies
    shown, ahead = bodies.copy(), np.zeros_like(bodies[0, 2:])
    ahead[0] = 1.0
    for frame in shown:
        rests = (frame[2:] == 0).all(axis=0)
        frame[2:] = ahead = np.where(rests, ahead, frame[2:])
    return shown


def _resting(bodies: Floats) -> str:
    rests: NDArray[np.bool_] = (bodies[:, 2:] == 0).all(axis=1)
    if not rests.any():
        return ""
    return base64.b64encode(np.packbits(rests, bitorder="little").tobytes()).decode()


def _pixels(simulation: Simulation) -> dict[str, Any] | None:
    if not looking.counts_visits(simulation):
        return None
    return looking.pixels(simulation)._asdict()
