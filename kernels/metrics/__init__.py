"""From recorded frames to numbers.

A metric is a kernel `(frames, filled, ground, observation, values)` that writes one
number for each of the `filled` first frames into `values`. To add one, write it and
enter it in METRICS.

Distances are those of the plane, on a torus too: boids that see each other across its
borders are not near each other here. Velocities are those at the end of a step, which
patel2023 limits only when it moves.

motion  speed, turns, headings     shape   radius, distances, elongation   flocks  connected groups
places  obstacles and the goal     energy  the pair potential             counted  coverage and events
"""

from kernels.metrics import counted, energy, flocks, motion, places, shape
from kernels.metrics.ground import Ground, Metric

__all__ = ["METRICS", "Ground", "Metric"]

_NGUYEN, _AZIEL = "nguyen2024, section 2.3", "aziel_chen2025, section 3.2"
_RUSTAMANI, _PATEL = "rustamani2024, section 3", "patel2023, section III"
METRICS: dict[str, Metric] = {
    "speed": Metric(motion.speed, "length/time", "mean speed", _NGUYEN),
    "flock_radius": Metric(shape.flock_radius, "length", "mean distance from the centre of mass", _NGUYEN),
    "turn_rate": Metric(motion.turn_rate, "degrees", "mean change of heading in a step, wrapped to [0, 180]", _NGUYEN),
    "turn_rate_unwrapped": Metric(
        motion.turn_rate_unwrapped, "degrees", "the same without wrapping, in [0, 360), as nguyen2024 ran it", _NGUYEN
    ),
    "dispersion": Metric(
        shape.dispersion, "length", "standard deviation of distances from the centre of mass", _NGUYEN
    ),
    "polarization": Metric(motion.polarization, "", "length of the mean unit velocity", "Vicsek et al. (1995)"),
    "nearest_neighbour_distance": Metric(
        shape.nearest_neighbour_distance, "length", "mean distance to the nearest other boid", "Clark and Evans (1954)"
    ),
    "elongation": Metric(
        shape.elongation, "", "of the largest flock: 1 a column, 0 round, -1 a broad front", _RUSTAMANI
    ),
    "neighbours_ahead": Metric(
        shape.neighbours_ahead, "%", "share of neighbours within flock_range that are ahead", _RUSTAMANI
    ),
    "flock_count": Metric(flocks.flock_count, "", "number of groups connected within flock_range", _PATEL),
    "largest_flock": Metric(flocks.largest_flock, "boids", "size of the largest such group", _PATEL),
    "largest_flock_share": Metric(flocks.largest_flock_share, "%", "the same, of all boids", _RUSTAMANI),
    "boids_lost": Metric(flocks.boids_lost, "boids", "number of boids outside the largest such group", _RUSTAMANI),
    "potential": Metric(
        energy.potential, "length^2/time^2", "mean potential energy of a boid", "patel2023, Eq. (27)", potential=True
    ),
    "flock_potential": Metric(
        energy.flock_potential, "length^2/time^2", "mean potential energy of a flock of two or more",
        "patel2023, Eq. (27)", potential=True,
    ),
    "clearance": Metric(places.clearance, "length", "mean distance from the nearest obstacle", _RUSTAMANI),
    "least_clearance": Metric(
        places.least_clearance, "length", "distance of the boid nearest to an obstacle", _RUSTAMANI
    ),
    "goal_distance": Metric(places.goal_distance, "length", "mean distance from the goal", _RUSTAMANI),
    "goal_spread": Metric(
        places.goal_spread, "length", "mean distance of the boids at the goal from their centre", _RUSTAMANI
    ),
    "coverage": Metric(counted.coverage, "%", "visited share of the traversable pixels", _AZIEL, covers=True),
    "coverage_total": Metric(
        counted.coverage_total, "%", "visited share of all pixels", "aziel_chen2025, as run", covers=True
    ),
    "coverage_cv": Metric(
        counted.coverage_cv, "", "coefficient of variation of visits to traversable pixels",
        "aziel_chen2025, section 4.2", covers=True,
    ),
    "escapes": Metric(counted.escapes, "", "times a boid left the world", "ours", counts=True),
    "collisions": Metric(counted.collisions, "", "times a boid entered an obstacle", "ours", counts=True),
    "boid_collisions": Metric(
        counted.boid_collisions, "", "times a boid came into contact with another", "ours", pairs=True
    ),
    "share_arrived": Metric(counted.share_arrived, "%", "boids that have been at the goal", _RUSTAMANI, counts=True),
    "time_to_goal": Metric(counted.time_to_goal, "time", "mean time of their first arrival", _RUSTAMANI, counts=True),
    "equilibrium": Metric(
        counted.equilibrium, "%", "boids in a local equilibrium: long in step with all neighbours", _PATEL, pairs=True
    ),
    "dead_ends": Metric(
        counted.dead_ends, "", "times a boid found no free heading", "rustamani2024, Alg. 7", counts=True
    ),
}  # fmt: skip
