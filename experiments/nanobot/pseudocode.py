"""The pseudocode of the document, line by line, and how far our boids are from it.

It follows the document's own lines and names, and shares no code with the model.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Floats = NDArray[np.float64]

DEFAULT = {
    "separation_range": 8.0,
    "perception_range": 40.0,
    "cohesion_weight": 0.0005,
    "separation_weight": 0.05,
    "alignment_weight": 0.05,
    "max_speed": 6.0,
    "min_speed": 3.0,
    "border_turn": 0.2,
    "border_margin": 100.0,
}
"""The values that are widely used with the pseudocode, by the names of our settings."""
NAMES = (
    "ProtectedRange",
    "VisualRange",
    "CenteringFactor",
    "AvoidFactor",
    "MatchingFactor",
    "MaxSpeed",
    "MinSpeed",
)
TERMS = dict(zip(DEFAULT, (*NAMES, "TurnFactor", "ScreenMargins"), strict=True))
"""The document's names of our settings."""
SCREEN = (640.0, 480.0)


def one_pass(place: Floats, velocity: Floats) -> None:
    """One pass of the main loop, in place. Both are (2, N), in px and px a step."""
    value = {term: DEFAULT[name] for name, term in TERMS.items()}
    for i in range(place.shape[1]):
        here, moving = place[:, i], velocity[:, i]
        away = here[:, None] - place
        squared_distance = (away * away).sum(axis=0)
        squared_distance[i] = np.inf  # IF boid_i != boid_j
        close = squared_distance < value["ProtectedRange"] ** 2
        neighbours = ~close & (squared_distance < value["VisualRange"] ** 2)
        if neighbours.any():
            middle = place[:, neighbours].mean(axis=1)
            moving += (middle - here) * value["CenteringFactor"]
            course = velocity[:, neighbours].mean(axis=1)
            moving += (course - moving) * value["MatchingFactor"]
        moving += away[:, close].sum(axis=1) * value["AvoidFactor"]
        for axis, size in enumerate(SCREEN):
            if here[axis] < value["ScreenMargins"]:
                moving[axis] += value["TurnFactor"]
            elif here[axis] > size - value["ScreenMargins"]:
                moving[axis] -= value["TurnFactor"]
        speed = np.hypot(*moving)
        if speed > value["MaxSpeed"]:
            moving *= value["MaxSpeed"] / speed
        elif speed < value["MinSpeed"]:
            moving *= value["MinSpeed"] / speed
        here += moving


def off_the_pseudocode(studies: Studies) -> Floats:
    """The farthest that a boid is, in a step, from where a pass of the pseudocode takes
    it from the step before, in px: one value a trial.
    """
    study = studies["pseudocode"]
    done = study.trials["status"] == "done"
    return np.array(
        [_farthest(study, trial) for trial in study.trials["trial_id"][done]]
    )


def _farthest(study: StoredStudy, trial: str) -> float:
    _, bodies = study.trajectory(trial)
    farthest = 0.0
    for before, after in pairwise(bodies):
        place, velocity = before[:2].copy(), before[2:4].copy()
        one_pass(place, velocity)
        farthest = max(farthest, float(np.hypot(*(place - after[:2])).max()))
    return farthest
