"""What boids know of each other and of themselves, message by message."""

import math
from typing import Any

import numpy as np
from scipy.linalg import expm

from kernels.chance import ChanceKey, chance, normals
from kernels.robots.purposes import LOSS, OWN_ERROR, SENT_ERROR
from tests.naive.flight import Bird, displacement
from tests.naive.rules import Vector


class Knowledge:
    """Of a flight with the settings `s`, which looks at each step once."""

    def __init__(self, s: dict[str, Any], world: Any, key: ChanceKey) -> None:
        self.s, self.world, self.key = s, world, key
        self.sent: list[list[Bird]] = []
        self.errors: dict[int, list[np.ndarray]] = {}
        self.truth: list[Bird] = []

    def own_and_heard(self, flock: list[Bird]) -> list[tuple[Bird, list[Bird]]]:
        """For each boid what it knows of itself, and those whom it hears of."""
        s, k = self.s, len(self.sent)
        self.sent.append(self._measured(flock, k, SENT_ERROR))
        own = {
            "none": lambda: flock,
            "shared": lambda: self.sent[k],
            "independent": lambda: self._measured(flock, k, OWN_ERROR),
        }[s["own_noise"]]()
        delay = round(s["sensing_delay"] / s["dt"])
        period = max(1, round(s["sensing_period"] / s["dt"]))
        sample = k - k % period
        if sample == k:
            self.truth = flock
        known = self.sent[max(sample - delay, 0)]
        return [
            (me, [known[j] for j in range(len(flock)) if self._hears(i, j, sample)])
            for i, me in enumerate(own)
        ]

    def _measured(self, flock: list[Bird], k: int, purpose: int) -> list[Bird]:
        """The flock with its errors at step `k`: of each axis those of place and
        velocity, by the exact solution of their stochastic equations.
        """
        s, still = self.s, np.diag([self.s["position_noise"], 0.0])
        still[1, 1] = s["velocity_noise"]
        law = np.zeros((2, 2))
        if s["noise_form"] == "coupled":
            spring = (s["velocity_noise"] / s["position_noise"]) ** 2
            law = expm(np.array([[0, 1], [-spring, -1 / s["noise_time"]]]) * s["dt"])
        elif s["noise_time"] > 0:
            law = np.eye(2) * math.exp(-s["dt"] / s["noise_time"])
        added = still @ still - law @ still @ still @ law.T
        lower = np.linalg.cholesky(added) if added.any() else added
        measured = []
        for i, bird in enumerate(flock):
            draws = [
                np.array(normals(self.key, k, i, axis, purpose)) for axis in (0, 1)
            ]
            if k == 0:
                errors = [still @ draw for draw in draws]
            else:
                before = self.errors[purpose, i]
                pairs = zip(before, draws, strict=True)
                errors = [law @ error + lower @ draw for error, draw in pairs]
            self.errors[purpose, i] = errors
            off = np.array(errors)
            measured.append(Bird(bird.position + off[:, 0], bird.velocity + off[:, 1]))
        return measured

    def _hears(self, i: int, j: int, sample: int) -> bool:
        here, there = self.truth[i].position, self.truth[j].position
        way = displacement(self.world, here, there)
        length = math.hypot(*way)
        lost = self.s["packet_loss"]
        if self.s["packet_loss_range"] < math.inf:
            lost *= (length / self.s["packet_loss_range"]) ** 2
        return (
            i != j
            and length <= self.s["radio_range"]
            and chance(self.key, sample, i, j, LOSS) >= lost
            and not self._is_hidden(here, way, (i, j))
        )

    def _is_hidden(self, here: Vector, way: Vector, pair: tuple[int, int]) -> bool:
        """Whether a body or a round obstacle is on the way."""
        length = math.hypot(*way)
        ahead = way / length
        aside = np.array([-ahead[1], ahead[0]])
        if self.s["occlusion"] in ("boids", "both"):
            for m, bird in enumerate(self.truth):
                to = displacement(self.world, here, bird.position)
                beside = 0 < to @ ahead < length
                if m not in pair and beside and abs(to @ aside) < self.s["body_radius"]:
                    return True
        if self.s["occlusion"] in ("obstacles", "both"):
            columns = (
                self.world.obstacle_x,
                self.world.obstacle_y,
                self.world.half_width,
            )
            for x, y, radius in zip(*columns, strict=True):
                to = np.array([x, y]) - here
                nearest = np.clip(to @ ahead, 0, length) * ahead
                if math.hypot(*(to - nearest)) < radius:
                    return True
        return False
