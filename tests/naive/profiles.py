"""The twins of profiles, by numpy over all pairs, waves and boxes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Way(NamedTuple):
    """Frames (F, 4, N) in a world; NaN for a boid without a position."""

    bodies: Floats
    width: float
    height: float
    periodic: bool

    @property
    def sides(self) -> Floats:
        return np.array([self.width, self.height])

    def present(self, f: int) -> Floats:
        """x, y, vx, vy of the boids of a frame, (4, n)."""
        frame: Floats = self.bodies[f]
        return frame[:, np.isfinite(frame[0])]

    def apart(self, differences: Floats) -> Floats:
        """Distances of differences (..., 2), the shortest with periodic borders."""
        if self.periodic:
            differences = differences - self.sides * np.round(differences / self.sides)
        lengths: Floats = np.hypot(differences[..., 0], differences[..., 1])
        return lengths


def pairs(way: Way, f: int) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    bodies = way.present(f)
    i, j = np.triu_indices(bodies.shape[1], 1)
    return way.apart((bodies[:2, j] - bodies[:2, i]).T), i, j


def pair_distribution(way: Way, edges: Floats) -> Floats:
    counts = np.zeros(len(edges) - 1)
    expected = 0.0
    for f in range(len(way.bodies)):
        distances, _, _ = pairs(way, f)
        inside = distances[distances < edges[-1]]
        counts += np.histogram(inside, edges)[0]
        expected += len(distances)
    rings = np.pi * np.diff(edges**2) / (way.width * way.height)
    return counts / (expected * rings)


def velocity_correlation_function(way: Way, edges: Floats) -> Floats:
    found = []
    where = []
    for f in range(len(way.bodies)):
        distances, i, j = pairs(way, f)
        velocity = way.present(f)[2:]
        deviation = velocity - velocity.mean(axis=1, keepdims=True)
        square = (deviation**2).sum(axis=0).mean()
        if square > 0.0:
            found.append((deviation[:, i] * deviation[:, j]).sum(axis=0) / square)
            where.append(distances)
    values = np.concatenate(found)
    bins = np.digitize(np.concatenate(where), edges) - 1
    means = [
        values[bins == k].mean() if (bins == k).any() else np.nan
        for k in range(len(edges) - 1)
    ]
    return np.array(means)


def structure_factor(way: Way, edges: Floats) -> Floats:
    found: list[list[float]] = [[] for _ in edges[1:]]
    most = [int(edges[-1] / (2 * np.pi / side)) for side in way.sides]
    for a in range(-most[0], most[0] + 1):
        for b in range(-most[1], most[1] + 1):
            wave = 2 * np.pi * np.array([a, b]) / way.sides
            k = int(np.digitize(np.hypot(*wave), edges)) - 1
            if not (a or b) or not 0 <= k < len(found):
                continue
            for f in range(len(way.bodies)):
                bodies = way.present(f)
                total = np.exp(-1j * (wave @ bodies[:2])).sum()
                found[k].append(abs(total) ** 2 / bodies.shape[1])
    return np.array([np.mean(values) if values else np.nan for values in found])


def number_fluctuations(way: Way, across: Floats) -> Floats:
    found = []
    for number in across.astype(int):
        squares = []
        for f in range(len(way.bodies)):
            bodies = way.present(f)
            if not bodies.size:
                continue
            counts, _, _ = np.histogram2d(
                bodies[0] / way.width,
                bodies[1] / way.height,
                bins=number,
                range=[[0, 1], [0, 1]],
            )
            squares.append((counts - counts.mean()) ** 2)
        found.append(np.sqrt(np.mean(squares)))
    return np.array(found)


def mean_squared_displacement(way: Way, lags: Floats) -> Floats:
    positions = way.bodies[:, :2].copy()
    if way.periodic:
        for i in range(positions.shape[2]):
            known = np.flatnonzero(np.isfinite(positions[:, 0, i]))
            steps = np.diff(positions[known, :, i], axis=0)
            steps -= way.sides * np.round(steps / way.sides)
            first = positions[known[0], :, i]
            positions[known[1:], :, i] = first + steps.cumsum(axis=0)
    found = []
    for lag in lags.astype(int):
        moved = positions[lag:] - positions[:-lag]
        found.append(np.nanmean((moved**2).sum(axis=1)))
    return np.array(found)


def neighbour_overlap(way: Way, lags: Floats) -> Floats:
    frames, _, n = way.bodies.shape
    near: list[list[set[int] | None]] = []
    for f in range(frames):
        positions = way.bodies[f, :2].T
        distances = way.apart(positions[:, None] - positions[None])
        np.fill_diagonal(distances, np.inf)
        distances = np.where(np.isnan(distances), np.inf, distances)
        order = np.argsort(distances, axis=1, kind="stable")[:, :6]
        full = np.isfinite(np.take_along_axis(distances, order, axis=1)).all(axis=1)
        near.append([set(order[i].tolist()) if full[i] else None for i in range(n)])
    found = []
    for lag in lags.astype(int):
        shares = [
            len(now & then) / 6
            for before, after in zip(near[:-lag], near[lag:], strict=True)
            for now, then in zip(before, after, strict=True)
            if now is not None and then is not None
        ]
        found.append(np.mean(shares) if shares else np.nan)
    return np.array(found)


def directional_delay(way: Way, lags: Floats) -> Floats:
    angles = np.arctan2(way.bodies[:, 3], way.bodies[:, 2])
    headings = np.exp(1j * np.nan_to_num(angles))
    headings[~way.bodies[:, 2:].any(axis=1) | np.isnan(angles)] = np.nan
    n = headings.shape[1]
    delays = np.full((n, n), np.nan)
    signed = sorted({s * int(lag) for lag in lags for s in (1, -1)}, key=abs)
    for i in range(n):
        for j in range(i):
            cosines = {}
            for lag in signed:
                first, second = (i, j) if lag >= 0 else (j, i)
                later = headings[abs(lag) :, second]
                terms = (np.conj(headings[: len(later), first]) * later).real
                if np.isfinite(terms).any():
                    cosines[lag] = np.nanmean(terms)
            if cosines:
                delays[i, j] = max(cosines, key=lambda lag: cosines[lag])
                delays[j, i] = -delays[i, j]
    known = np.isfinite(delays)
    sums = np.where(known, delays, 0.0).sum(axis=1)
    counts = known.sum(axis=1)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
