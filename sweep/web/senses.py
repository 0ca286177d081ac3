"""The facts from which a page computes perceived neighbours, flocks and visits.

Together with these facts positions are sufficient.
"""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.trial import Simulation, looking
from sweep.web.encoding import Floats
from sweep.web.protocol import plain
from sweep.web.running import recorded, simulation_of


def senses_of(job: Job, bodies: Floats) -> dict[str, Any]:
    """Return the data that the script of a recording reads in addition to the frames.

    Parameters
    ----------
    job : Job
        The trial.
    bodies : array (F, 4, N)
        x, y, vx and vy of the frames.

    Returns
    -------
    dict
        ``range``, ``fov`` in degrees and ``inclusive`` describe the longest search of
        the model. With ``shortest_way`` distances are taken through the borders.
        ``flock_range`` is the range of the metrics of flocks. ``resting`` has a bit for
        each boid of each frame, in base64: 1 for a boid that rests and so sees all
        round; "" if no boid rests. With ``measured`` boids know measured and received
        states, which no frame has. ``pixels`` is None where no visits are counted.
    """
    simulation = simulation_of(job, recorded(job, (), visits=True))
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
    """Return the bodies with the heading of boids that rest.

    If boids of the model see along the heading, a resting boid gets the last velocity
    before the rest; a boid that rests from the start looks along +x. `bodies` and the
    returned array have shape (F, 4, N).
    """
    if not looking.faces_heading(simulation_of(job, recorded(job, ()))):
        return bodies
    shown = bodies.copy()
    ahead = np.zeros_like(bodies[0, 2:])
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
