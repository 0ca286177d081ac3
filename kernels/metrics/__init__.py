"""From recorded frames to numbers.

A metric is a kernel `(frames, filled, ground, observation, values)` that writes one
number for each of the `filled` first frames into `values`. To add one, write it and
enter it in METRICS.

Distances are those of the plane, on a torus too: boids that see each other across its
borders are not near each other here. Velocities are those at the end of a step, which
patel2023 limits only when it moves.

motion  speed, turns, headings    shape    radius, distances, elongation
flocks  connected groups          places   obstacles and the goal
energy  the pair potential        counted  coverage and events
ground  what a metric is, and what it gets to see
"""

from kernels.metrics import counted, energy, flocks, motion, places, shape
from kernels.metrics.ground import Better, Distribution, Ground, Metric
from kernels.registry import Registry
from kernels.settings import PIXELS, Demand

__all__ = ["METRICS", "Better", "Distribution", "Ground", "Metric"]

_NGUYEN, _AZIEL = "nguyen2024, section 2.3", "aziel_chen2025, section 3.2"
_RUSTAMANI, _PATEL = "rustamani2024, section 3", "patel2023, section III"
_GOAL = Demand(
    "0 <= goal_x <= width and 0 <= goal_y <= height",
    "the goal lies outside the world, and what is recorded is about the goal",
)
METRICS = Registry(
    "boidsweep.metrics",
    Metric,
    {
        "speed": Metric(
            motion.speed,
            unit="length/time",
            text="mean speed",
            source=_NGUYEN,
        ),
        "flock_radius": Metric(
            shape.flock_radius,
            unit="length",
            text="mean distance from the centre of mass",
            source=_NGUYEN,
            distribution="skewed",
        ),
        "turn_rate": Metric(
            motion.turn_rate,
            unit="degrees",
            text="mean change of heading in a step, wrapped to [0, 180]",
            source=_NGUYEN,
            distribution="skewed",
            per_step=True,
        ),
        "turn_rate_unwrapped": Metric(
            motion.turn_rate_unwrapped,
            unit="degrees",
            text="the same without wrapping, in [0, 360), as nguyen2024 ran it",
            source=_NGUYEN,
            distribution="skewed",
            per_step=True,
        ),
        "dispersion": Metric(
            shape.dispersion,
            unit="length",
            text="standard deviation of distances from the centre of mass",
            source=_NGUYEN,
            distribution="skewed",
        ),
        "polarization": Metric(
            motion.polarization,
            unit="",
            text="length of the mean unit velocity",
            source="Vicsek et al. (1995)",
        ),
        "nearest_neighbour_distance": Metric(
            shape.nearest_neighbour_distance,
            unit="length",
            text="mean distance to the nearest other boid",
            source="Clark and Evans (1954)",
            pairwise=True,
        ),
        "in_contact": Metric(
            shape.in_contact,
            unit="%",
            text="share of boids nearer than contact_distance to another",
            source="ours",
            better="low",
            pairwise=True,
        ),
        "elongation": Metric(
            shape.elongation,
            unit="",
            text="of the largest flock: 1 a column, 0 round, -1 a broad front",
            source=_RUSTAMANI,
            distribution="skewed",
            pairwise=True,
        ),
        "neighbours_ahead": Metric(
            shape.neighbours_ahead,
            unit="%",
            text="share of neighbours within flock_range that are ahead",
            source=_RUSTAMANI,
            distribution="percentage",
            pairwise=True,
        ),
        "flock_count": Metric(
            flocks.flock_count,
            unit="",
            text="number of groups connected within flock_range",
            source=_PATEL,
            distribution="skewed",
            pairwise=True,
        ),
        "largest_flock": Metric(
            flocks.largest_flock,
            unit="boids",
            text="size of the largest such group",
            source=_PATEL,
            distribution="skewed",
            pairwise=True,
        ),
        "largest_flock_share": Metric(
            flocks.largest_flock_share,
            unit="%",
            text="the same, of all boids",
            source=_RUSTAMANI,
            distribution="percentage",
            pairwise=True,
        ),
        "boids_lost": Metric(
            flocks.boids_lost,
            unit="boids",
            text="number of boids outside the largest such group",
            source=_RUSTAMANI,
            distribution="count",
            better="low",
            pairwise=True,
        ),
        "potential": Metric(
            energy.potential,
            unit="length^2/time^2",
            text="mean potential energy of a boid",
            source="patel2023, Eq. (27)",
            distribution="skewed",
            pairwise=True,
            potential=True,
        ),
        "flock_potential": Metric(
            energy.flock_potential,
            unit="length^2/time^2",
            text="mean potential energy of a flock of two or more",
            source="patel2023, Eq. (27)",
            distribution="skewed",
            pairwise=True,
            potential=True,
        ),
        "clearance": Metric(
            places.clearance,
            unit="length",
            text="mean distance from the nearest obstacle",
            source=_RUSTAMANI,
            distribution="skewed",
        ),
        "least_clearance": Metric(
            places.least_clearance,
            unit="length",
            text="distance of the boid nearest to an obstacle",
            source=_RUSTAMANI,
            distribution="skewed",
        ),
        "goal_distance": Metric(
            places.goal_distance,
            unit="length",
            text="mean distance from the goal",
            source=_RUSTAMANI,
            distribution="skewed",
            better="low",
            demands=(_GOAL,),
        ),
        "goal_spread": Metric(
            places.goal_spread,
            unit="length",
            text="mean distance of the boids at the goal from their centre",
            source=_RUSTAMANI,
            better="low",
            demands=(_GOAL,),
        ),
        "coverage": Metric(
            counted.coverage,
            unit="%",
            text="visited share of the traversable pixels",
            source=_AZIEL,
            covers=True,
            demands=PIXELS,
            short="coverage",
        ),
        "coverage_total": Metric(
            counted.coverage_total,
            unit="%",
            text="visited share of all pixels",
            source="aziel_chen2025, as run",
            covers=True,
            demands=PIXELS,
        ),
        "coverage_cv": Metric(
            counted.coverage_cv,
            unit="",
            text="coefficient of variation of visits to traversable pixels",
            source="aziel_chen2025, section 4.2",
            better="low",
            covers=True,
            demands=PIXELS,
            short="CV",
        ),
        "escapes": Metric(
            counted.escapes,
            unit="",
            text="times a boid left the world",
            source="ours",
            distribution="count",
            better="low",
            counts=True,
        ),
        "collisions": Metric(
            counted.collisions,
            unit="",
            text="times a boid entered an obstacle",
            source="ours",
            distribution="count",
            better="low",
            counts=True,
        ),
        "boid_collisions": Metric(
            counted.boid_collisions,
            unit="",
            text="times a boid came into contact with another",
            source="ours",
            distribution="count",
            better="low",
            pairs=True,
        ),
        "share_arrived": Metric(
            counted.share_arrived,
            unit="%",
            text="boids that have been at the goal",
            source=_RUSTAMANI,
            distribution="percentage",
            counts=True,
            demands=(_GOAL,),
        ),
        "time_to_goal": Metric(
            counted.time_to_goal,
            unit="time",
            text="mean time of their first arrival",
            source=_RUSTAMANI,
            distribution="skewed",
            better="low",
            counts=True,
            demands=(_GOAL,),
        ),
        "equilibrium": Metric(
            counted.equilibrium,
            unit="%",
            text="boids in a local equilibrium: long in step with all neighbours",
            source=_PATEL,
            distribution="percentage",
            pairs=True,
        ),
        "dead_end_time": Metric(
            counted.dead_end_time,
            unit="time",
            text="time without a free heading, a sum over boids",
            source="rustamani2024, Alg. 7",
            distribution="skewed",
            better="low",
            counts=True,
        ),
    },
)
