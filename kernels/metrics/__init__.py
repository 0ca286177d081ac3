"""Metrics: kernels that turn recorded frames into numbers.

A metric is a kernel `(frames, filled, ground, observation, values)` that writes one
number for each of the `filled` first frames into `values`. To add a metric, write a
kernel and enter the kernel in METRICS.

Distances are in the plane, also with periodic boundaries: boids that perceive each
other across the borders are not near. Velocities are the velocities at the end of a
step, which patel2023 limits only in the next move.

motion  speed, turns, headings    shape    radius, distances, elongation, turning
flocks  connected groups          places   obstacles and the goal
spectrum  connectivity of the graph of near boids
energy  the pair potential        counted  coverage, events, integrals over time
herd    a herd of sheep, and the dog
ground  types: a metric, and the inputs of metrics
parts   metrics of boids of one kind, or of boids that have not failed
"""

from kernels.metrics import (
    counted,
    energy,
    flocks,
    herd,
    motion,
    places,
    shape,
    spectrum,
)
from kernels.metrics.ground import Better, Distribution, Ground, Metric, Range
from kernels.metrics.parts import of_any_model, of_part
from kernels.registry import Registry
from kernels.settings import PIXELS, Demand

__all__ = ["METRICS", "Better", "Distribution", "Ground", "Metric", "Range"]

_NGUYEN = "nguyen2024, section 2.3"
_AZIEL = "aziel_chen2025, section 3.2"
_VASARHELYI = "Vasarhelyi et al. (2018)"
_RUSTAMANI = "rustamani2024, section 3"
_PATEL = "patel2023, section III"
_STROMBOM = "Strombom et al. (2014)"
_FLOCKS = (
    r" Flocks are the connected components of the graph that joins boids $i$ and $j$"
    r" with $|p_i - p_j| < r$, where $r$ is `flock_range`."
)
_HERD = ("sheep", "dog")
_GOAL = Demand(
    "0 <= goal_x <= width and 0 <= goal_y <= height",
    "the goal lies outside the world, and what is recorded is about the goal",
)


def _of_part(name: str) -> Metric | None:
    """Return the metric of a part of the boids, derived from a metric in METRICS."""
    metric: Metric | None = of_any_model(name, METRICS, of_part)
    return metric


METRICS = Registry(
    "boidsweep.metrics",
    Metric,
    {
        "speed": Metric(
            motion.speed,
            unit="length/time",
            text="mean speed",
            source=_NGUYEN,
            distribution="normal",
            better="neither",
            low=0.0,
            formula=r"$\frac{1}{N} \sum_{i=1}^{N} |v_i|$",
        ),
        "flock_radius": Metric(
            shape.flock_radius,
            unit="length",
            text="mean distance from the centre of mass",
            source=_NGUYEN,
            distribution="skewed",
            better="neither",
            low=0.0,
            formula=r"$\frac{1}{N} \sum_{i=1}^{N} |p_i - \bar p|$",
        ),
        "turn_rate": Metric(
            motion.turn_rate,
            unit="degrees",
            text="mean change of heading in a step, wrapped to [0, 180]",
            source=_NGUYEN,
            distribution="skewed",
            better="neither",
            per_step=True,
            low=0.0,
            high=180.0,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} \min(\delta_i, 360 - \delta_i)$ with"
                r" $\delta_i = |\theta_i(k) - \theta_i(k - 1)|$, where $\theta_i(k)$ is"
                r" the heading after step $k$, from $-180$ to $180$ degrees."
                r" $\delta_i = 0$ if one of the two velocities is $0$."
            ),
        ),
        "turn_rate_unwrapped": Metric(
            motion.turn_rate_unwrapped,
            unit="degrees",
            text="mean change of heading in a step, not wrapped, as nguyen2024 ran it",
            source=_NGUYEN,
            distribution="skewed",
            better="neither",
            per_step=True,
            low=0.0,
            high=360.0,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} |\theta_i(k) - \theta_i(k - 1)|$, where"
                r" $\theta_i(k)$ is the heading after step $k$, from $-180$ to $180$"
                r" degrees. A boid counts as $0$ if one of the two velocities is $0$."
            ),
        ),
        "dispersion": Metric(
            shape.dispersion,
            unit="length",
            text="standard deviation of distances from the centre of mass",
            source=_NGUYEN,
            distribution="skewed",
            better="neither",
            low=0.0,
            formula=(
                r"$\sqrt{\frac{1}{N} \sum_{i=1}^{N} (d_i - \bar d)^2}$ with"
                r" $d_i = |p_i - \bar p|$ and"
                r" $\bar d = \frac{1}{N} \sum_{i=1}^{N} d_i$."
            ),
        ),
        "polarization": Metric(
            motion.polarization,
            unit="",
            text="length of the mean unit velocity",
            source="Vicsek et al. (1995)",
            distribution="normal",
            better="neither",
            low=0.0,
            high=1.0,
            formula=(
                r"$\frac{1}{N} \left| \sum_{i=1}^{N} \hat{v}_i \right|$ with"
                r" $\hat{v}_i = \frac{v_i}{|v_i|}$, or $0$ for a boid at rest."
            ),
        ),
        "group_speed": Metric(
            motion.group_speed,
            unit="length/time",
            text="speed of the centre of mass: length of the mean velocity",
            source="ours",
            distribution="normal",
            better="neither",
            low=0.0,
            formula=r"$\frac{1}{N} \left| \sum_{i=1}^{N} v_i \right|$",
        ),
        "velocity_correlation": Metric(
            motion.velocity_correlation,
            unit="",
            text="mean cosine between the velocities of two boids, over all pairs",
            source=_VASARHELYI,
            distribution="normal",
            better="neither",
            low=-1.0,
            high=1.0,
            formula=(
                r"$\frac{2}{N (N - 1)} \sum_{i < j} \hat{v}_i \cdot \hat{v}_j$ with"
                r" $\hat{v}_i = \frac{v_i}{|v_i|}$, or $0$ for a boid at rest. NaN for"
                r" $N = 1$."
            ),
        ),
        "velocity_diameter": Metric(
            motion.velocity_diameter,
            unit="length/time",
            text="greatest difference of two velocities: 0 if all velocities are equal",
            source="Cucker and Smale (2007)",
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=0.0,
            formula=r"$\max_{i, j} |v_i - v_j|$",
        ),
        "angular_momentum": Metric(
            shape.angular_momentum,
            unit="",
            text="group angular momentum about the centre of mass: 1 for a mill",
            source="Couzin et al. (2002)",
            distribution="normal",
            better="neither",
            low=0.0,
            high=1.0,
            formula=(
                r"$\frac{1}{N} \left| \sum_{i=1}^{N} \hat{r}_i \times \hat{v}_i"
                r" \right|$, where $\hat{r}_i$ and $\hat{v}_i$ are the unit vectors"
                r" along $p_i - \bar p$ and $v_i$. A boid at rest or at $\bar p$ counts"
                r" as $0$."
            ),
        ),
        "nearest_neighbour_distance": Metric(
            shape.nearest_neighbour_distance,
            unit="length",
            text="mean distance to the nearest other boid",
            source="Clark and Evans (1954)",
            distribution="normal",
            better="neither",
            pairwise=True,
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} \min_{j \ne i} |p_i - p_j|$. NaN for"
                r" $N = 1$."
            ),
        ),
        "in_contact": Metric(
            shape.in_contact,
            unit="%",
            text="fraction of boids nearer than contact_distance to another",
            source="ours",
            distribution="normal",
            better="low",
            pairwise=True,
            low=0.0,
            high=100.0,
            within="contact_distance",
            formula=(
                r"$\frac{100}{N} \sum_{i=1}^{N} c_i$, where $c_i = 1$ if"
                r" $|p_i - p_j| < d$ for some $j \ne i$, else $0$. $d$ is"
                r" `contact_distance`."
            ),
        ),
        "least_distance": Metric(
            shape.least_distance,
            unit="length",
            text="distance of the two boids nearest to each other",
            source=_VASARHELYI,
            distribution="skewed",
            pairwise=True,
            low=0.0,
            formula=r"$\min_{i < j} |p_i - p_j|$. NaN for $N = 1$.",
        ),
        "pairs_in_contact": Metric(
            shape.pairs_in_contact,
            unit="%",
            text="fraction of pairs of boids nearer than contact_distance",
            source=_VASARHELYI,
            distribution="percentage",
            better="low",
            pairwise=True,
            within="contact_distance",
            formula=(
                r"$\frac{200}{N (N - 1)} \sum_{i < j} c_{ij}$, where $c_{ij} = 1$ if"
                r" $|p_i - p_j| < d$, else $0$. $d$ is `contact_distance`. NaN for"
                r" $N = 1$."
            ),
        ),
        "elongation": Metric(
            shape.elongation,
            unit="",
            text="elongation of the largest flock: 1 column, 0 round, -1 broad front",
            source=_RUSTAMANI,
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=-1.0,
            high=1.0,
            within="flock_range",
            formula=(
                r"$\frac{a - b}{a + b}$, where $a$ and $b$ are the standard deviations"
                r" of the positions in the largest flock along and across its mean"
                r" velocity. NaN for $a + b = 0$, without a mean velocity, and for"
                r" fewer than three boids." + _FLOCKS
            ),
        ),
        "neighbours_ahead": Metric(
            shape.neighbours_ahead,
            unit="%",
            text="fraction of neighbours within flock_range that are ahead",
            source=_RUSTAMANI,
            distribution="percentage",
            better="neither",
            pairwise=True,
            within="flock_range",
            formula=(
                r"$100 \frac{A}{M}$ over all ordered pairs of a boid $i$ that moves and"
                r" a boid $j \ne i$ with $|p_j - p_i| < r$. $M$ is the number of these"
                r" pairs, $A$ the number of those with $v_i \cdot (p_j - p_i) > 0$, and"
                r" $r$ is `flock_range`. NaN for $M = 0$."
            ),
        ),
        "flock_count": Metric(
            flocks.flock_count,
            unit="",
            text="number of groups connected within flock_range",
            source=_PATEL,
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=1.0,
            within="flock_range",
            formula=r"The number of flocks." + _FLOCKS,
        ),
        "largest_flock": Metric(
            flocks.largest_flock,
            unit="boids",
            text="size of the largest group connected within flock_range",
            source=_PATEL,
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=1.0,
            within="flock_range",
            formula=r"$\max_F |F|$ over all flocks $F$." + _FLOCKS,
        ),
        "largest_flock_share": Metric(
            flocks.largest_flock_share,
            unit="%",
            text="fraction of boids in the largest group connected within flock_range",
            source=_RUSTAMANI,
            distribution="percentage",
            better="neither",
            pairwise=True,
            within="flock_range",
            formula=r"$\frac{100}{N} \max_F |F|$ over all flocks $F$." + _FLOCKS,
        ),
        "boids_lost": Metric(
            flocks.boids_lost,
            unit="boids",
            text="number of boids outside the largest group within flock_range",
            source=_RUSTAMANI,
            distribution="count",
            better="low",
            pairwise=True,
            within="flock_range",
            formula=r"$N - \max_F |F|$ over all flocks $F$." + _FLOCKS,
        ),
        "smallest_flock": Metric(
            flocks.smallest_flock,
            unit="boids",
            text="size of the smallest group within flock_range; a boid alone is one",
            source=_VASARHELYI,
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=1.0,
            within="flock_range",
            formula=r"$\min_F |F|$ over all flocks $F$." + _FLOCKS,
        ),
        "boids_alone": Metric(
            flocks.boids_alone,
            unit="boids",
            text="number of boids that have no other within flock_range",
            source=_VASARHELYI,
            distribution="count",
            better="low",
            pairwise=True,
            within="flock_range",
            formula=(
                r"The number of boids $i$ with $|p_i - p_j| \ge r$ for all $j \ne i$,"
                r" where $r$ is `flock_range`."
            ),
        ),
        "flock_correlation": Metric(
            flocks.flock_correlation,
            unit="",
            text="mean cosine between the velocities of a boid and its flockmates",
            source=_VASARHELYI,
            distribution="normal",
            better="neither",
            pairwise=True,
            low=-1.0,
            high=1.0,
            within="flock_range",
            formula=(
                r"$\frac{1}{M} \sum_i \frac{1}{|F_i| - 1} \sum_{j \in F_i, j \ne i}"
                r" \hat{v}_i \cdot \hat{v}_j$ over the $M$ boids whose flock $F_i$ has"
                r" at least two boids, with $\hat{v}_i = \frac{v_i}{|v_i|}$, or $0$ for"
                r" a boid at rest. NaN for $M = 0$." + _FLOCKS
            ),
        ),
        "algebraic_connectivity": Metric(
            spectrum.algebraic_connectivity,
            unit="",
            text="second smallest Laplacian eigenvalue of the graph within flock_range",
            source="Fiedler (1973)",
            distribution="skewed",
            better="neither",
            pairwise=True,
            low=0.0,
            cubic=True,
            within="flock_range",
            formula=(
                r"The second smallest eigenvalue of $D - A$, where $A_{ij} = 1$ if"
                r" $i \ne j$ and $|p_i - p_j| < r$, else $0$, and $D$ is diagonal with"
                r" $D_{ii} = \sum_j A_{ij}$. $r$ is `flock_range`. NaN for $N = 1$."
            ),
        ),
        "potential": Metric(
            energy.potential,
            unit="length^2/time^2",
            text="mean potential energy of a boid",
            source="patel2023, Eq. (27)",
            distribution="skewed",
            better="neither",
            pairwise=True,
            potential=True,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} \sum_{j \ne i} V_i(|p_i - p_j|)$ with"
                r" $V_i(r) = \begin{cases}"
                r" \frac{1}{2} (a - \frac{c}{n_i}) (r_s^2 - r^2) & r < r_s \\"
                r" \frac{1}{2} \frac{c}{n_i} (r^2 - r_s^2) & r_s \le r < r_c \\"
                r" 0 & r \ge r_c \end{cases}$. Here $a$ and $c$ are the strengths of"
                r" separation and cohesion, and $r_s$ and $r_c$ are the ranges. $n_i$"
                r" is the number of boids nearer than $r_c$ to boid $i$. If boids"
                r" nearer than $r_s$ do not cohere, $n_i$ leaves out these boids, and"
                r" the first line has $a$ in place of $a - \frac{c}{n_i}$."
            ),
        ),
        "flock_potential": Metric(
            energy.flock_potential,
            unit="length^2/time^2",
            text="mean potential energy of a flock of two or more",
            source="patel2023, Eq. (27)",
            distribution="skewed",
            better="neither",
            pairwise=True,
            potential=True,
            within="flock_range",
            formula=(
                r"$\frac{1}{M} \sum_i \sum_{j \ne i} V_i(|p_i - p_j|)$ over the boids"
                r" $i$ of the $M$ flocks of at least two boids and all boids $j$, with"
                r" $V_i$ as in `potential`. NaN for $M = 0$." + _FLOCKS
            ),
        ),
        "clearance": Metric(
            places.clearance,
            unit="length",
            text="mean distance from the nearest obstacle",
            source=_RUSTAMANI,
            distribution="skewed",
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} \min_m d_m(p_i)$, where $d_m(p)$ is the"
                r" distance of $p$ from the surface of obstacle $m$, negative inside."
                r" NaN without obstacles."
            ),
        ),
        "least_clearance": Metric(
            places.least_clearance,
            unit="length",
            text="distance of the boid nearest to an obstacle",
            source=_RUSTAMANI,
            distribution="skewed",
            formula=(
                r"$\min_{i, m} d_m(p_i)$, where $d_m(p)$ is the distance of $p$ from"
                r" the surface of obstacle $m$, negative inside. NaN without obstacles."
            ),
        ),
        "depth_outside": Metric(
            places.depth_outside,
            unit="length",
            text="mean depth outside the world or in an obstacle, over all boids",
            source=_VASARHELYI,
            distribution="skewed",
            better="low",
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} \max(w(p_i), -\min_m d_m(p_i))$, where"
                r" $w(p)$ is the distance of $p$ from the world, $0$ inside it, and"
                r" $d_m(p)$ the distance from the surface of obstacle $m$, negative"
                r" inside. Without obstacles the mean of $w(p_i)$."
            ),
        ),
        "goal_distance": Metric(
            places.goal_distance,
            unit="length",
            text="mean distance from the goal, or from the last of several",
            source=_RUSTAMANI,
            distribution="skewed",
            better="low",
            demands=(_GOAL,),
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} |p_i - g|$, where $g$ is the goal, or the"
                r" last of several."
            ),
        ),
        "goal_spread": Metric(
            places.goal_spread,
            unit="length",
            text="mean distance of the boids at the goal from their centre",
            source=_RUSTAMANI,
            distribution="normal",
            better="low",
            demands=(_GOAL,),
            low=0.0,
            within="goal_radius",
            formula=(
                r"$\frac{1}{|A|} \sum_{i \in A} |p_i - \bar p_A|$, where $A$ are the"
                r" boids with $|p_i - g| < R$ and $\bar p_A$ is their mean position."
                r" $g$ is the goal, or the last of several, and $R$ is `goal_radius`."
                r" NaN for fewer than two boids."
            ),
        ),
        "coverage": Metric(
            counted.coverage,
            unit="%",
            text="visited fraction of the traversable pixels",
            source=_AZIEL,
            distribution="normal",
            covers=True,
            demands=PIXELS,
            short="coverage",
            low=0.0,
            high=100.0,
            formula=(
                r"$100 \frac{C}{P}$, where $C$ of the $P$ pixels outside obstacles have"
                r" been visited. After each step a boid visits the pixels of its"
                r" `footprint`."
            ),
        ),
        "coverage_total": Metric(
            counted.coverage_total,
            unit="%",
            text="visited fraction of all pixels",
            source="aziel_chen2025, as run",
            distribution="normal",
            covers=True,
            demands=PIXELS,
            low=0.0,
            high=100.0,
            formula=(
                r"$100 \frac{C}{P}$, where $C$ pixels outside obstacles have been"
                r" visited and $P$ is the number of all pixels. After each step a boid"
                r" visits the pixels of its `footprint`."
            ),
        ),
        "coverage_cv": Metric(
            counted.coverage_cv,
            unit="",
            text="coefficient of variation of visits to traversable pixels",
            source="aziel_chen2025, section 4.2",
            distribution="normal",
            better="low",
            covers=True,
            demands=PIXELS,
            short="CV",
            low=0.0,
            reads=("coverage_cv_ddof",),
            formula=(
                r"$\frac{1}{\bar n} \sqrt{\frac{1}{P - f} \sum_{q=1}^{P}"
                r" (n_q - \bar n)^2}$, where $n_q$ is the number of visits to pixel $q$"
                r" of the $P$ outside obstacles, $\bar n$ their mean and $f$"
                r" `coverage_cv_ddof`. After each step a boid visits the pixels of its"
                r" `footprint`. NaN for $\bar n = 0$."
            ),
        ),
        "escapes": Metric(
            counted.escapes,
            unit="",
            text="times a boid left the world",
            source="ours",
            distribution="count",
            better="low",
            counts=True,
            formula=(
                r"$\sum_{k=1}^{K} \sum_{i=1}^{N} o_i(k) (1 - o_i(k - 1))$ over the $K$"
                r" steps done, where $o_i(k) = 1$ if boid $i$ is outside the world"
                r" after step $k$, else $0$."
            ),
        ),
        "collisions": Metric(
            counted.collisions,
            unit="",
            text="times a boid entered an obstacle",
            source="ours",
            distribution="count",
            better="low",
            counts=True,
            formula=(
                r"$\sum_{k=1}^{K} \sum_{i=1}^{N} o_i(k) (1 - o_i(k - 1))$ over the $K$"
                r" steps done, where $o_i(k) = 1$ if the position of boid $i$ is inside"
                r" an obstacle after step $k$, else $0$."
            ),
        ),
        "boid_collisions": Metric(
            counted.boid_collisions,
            unit="",
            text="times a boid came into contact with another",
            source="ours",
            distribution="count",
            better="low",
            pairs=True,
            within="contact_distance",
            formula=(
                r"$\sum_{k=1}^{K} \sum_{i=1}^{N} c_i(k) (1 - c_i(k - 1))$ over the $K$"
                r" steps done, where $c_i(k) = 1$ if $|p_i - p_j| < d$ for some"
                r" $j \ne i$ after step $k$, else $0$. $d$ is `contact_distance`."
            ),
        ),
        "pair_collisions": Metric(
            counted.pair_collisions,
            unit="",
            text="times two boids came into contact with each other",
            source="ours",
            distribution="count",
            better="low",
            pairs=True,
            within="contact_distance",
            formula=(
                r"$\sum_{k=1}^{K} \sum_{i < j} c_{ij}(k) (1 - c_{ij}(k - 1))$ over the"
                r" $K$ steps done, where $c_{ij}(k) = 1$ if $|p_i - p_j| < d$ after"
                r" step $k$, else $0$. $d$ is `contact_distance`."
            ),
        ),
        "collision_rate": Metric(
            counted.collision_rate,
            unit="1/time",
            text="collisions per boid and unit of time, of two boids or with obstacles",
            source="ours",
            distribution="skewed",
            better="low",
            counts=True,
            pairs=True,
            low=0.0,
            within="contact_distance",
            formula=(
                r"$\frac{B + C}{N K \Delta t}$, where $B$ and $C$ are"
                r" `pair_collisions` and `collisions` after $K$ steps of $\Delta t$."
                r" NaN for $K = 0$."
            ),
        ),
        "fissions": Metric(
            counted.fissions,
            unit="",
            text="times a flock parted, from frame to frame",
            source="Palla et al. (2007)",
            distribution="count",
            better="low",
            follows=True,
            within="flock_range",
            formula=(
                r"$\sum_f \sum_F (m_F - 1)$ over the recorded frames $f$ after the"
                r" start and the flocks $F$ of the frame before, where the boids of $F$"
                r" are in $m_F$ flocks of frame $f$." + _FLOCKS
            ),
        ),
        "fusions": Metric(
            counted.fusions,
            unit="",
            text="times two flocks joined, from frame to frame",
            source="Palla et al. (2007)",
            distribution="count",
            better="neither",
            follows=True,
            within="flock_range",
            formula=(
                r"$\sum_f \sum_F (m_F - 1)$ over the recorded frames $f$ after the"
                r" start and their flocks $F$, where the boids of $F$ come from $m_F$"
                r" flocks of the frame before." + _FLOCKS
            ),
        ),
        "path_length": Metric(
            counted.path_length,
            unit="length",
            text="mean length of the paths: integral of the speed",
            source="ours",
            distribution="skewed",
            better="low",
            integrates=True,
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{k=1}^{K} \sum_{i=1}^{N} |v_i(k)| \Delta t$, where"
                r" $v_i(k)$ is the velocity after step $k$ of the $K$ done."
            ),
        ),
        "control_effort": Metric(
            counted.control_effort,
            unit="length^2/time^3",
            text="mean integral of the square of the acceleration over time",
            source="Athans and Falb (1966)",
            distribution="skewed",
            better="low",
            integrates=True,
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{k=1}^{K} \sum_{i=1}^{N}"
                r" \frac{|v_i(k) - v_i(k - 1)|^2}{\Delta t}$, where $v_i(k)$ is the"
                r" velocity after step $k$ of the $K$ done."
            ),
        ),
        "mechanical_work": Metric(
            counted.mechanical_work,
            unit="length^2/time^2",
            text="mean work per unit of mass: sum of all gains of speed^2 / 2",
            source="ours",
            distribution="skewed",
            better="low",
            integrates=True,
            low=0.0,
            formula=(
                r"$\frac{1}{N} \sum_{k=1}^{K} \sum_{i=1}^{N}"
                r" \max(0, \frac{1}{2} (|v_i(k)|^2 - |v_i(k - 1)|^2))$, where $v_i(k)$"
                r" is the velocity after step $k$ of the $K$ done."
            ),
        ),
        "share_arrived": Metric(
            counted.share_arrived,
            unit="%",
            text="fraction of boids that have been at the goal, or at all of several",
            source=_RUSTAMANI,
            distribution="percentage",
            counts=True,
            demands=(_GOAL,),
            within="goal_radius",
            formula=(
                r"$\frac{100}{N} |A|$, where $A$ are the boids that have been nearer"
                r" than `goal_radius` to the goal, or to each of several in turn, at"
                r" the start or after a step."
            ),
        ),
        "time_to_goal": Metric(
            counted.time_to_goal,
            unit="time",
            text="mean time of the first arrival at the goal, or at all of several",
            source=_RUSTAMANI,
            distribution="skewed",
            better="low",
            counts=True,
            demands=(_GOAL,),
            low=0.0,
            within="goal_radius",
            formula=(
                r"$\frac{1}{|A|} \sum_{i \in A} k_i \Delta t$, where $A$ are the boids"
                r" that have arrived (see `share_arrived`), and $k_i$ is the number of"
                r" steps until the first arrival, at the last goal of several. NaN if"
                r" none has arrived."
            ),
        ),
        "goals_reached": Metric(
            counted.goals_reached,
            unit="",
            text="mean number of goals that a boid has reached in turn",
            source="ours",
            distribution="normal",
            counts=True,
            demands=(_GOAL,),
            low=0.0,
            within="goal_radius",
            formula=(
                r"$\frac{1}{N} \sum_{i=1}^{N} m_i$, where boid $i$ has reached $m_i$"
                r" goals in turn. A goal is reached within `goal_radius`, at the start"
                r" or after a step, and at most one at a time."
            ),
        ),
        "equilibrium": Metric(
            counted.equilibrium,
            unit="%",
            text="fraction of boids that are long synchronised with all neighbours",
            source=_PATEL,
            distribution="percentage",
            pairs=True,
            reads=("flock_range", "equilibrium_tolerance", "equilibrium_steps"),
            formula=(
                r"$\frac{100}{N} \sum_{i=1}^{N} e_i$, where $e_i = 1$ if after each of"
                r" the last `equilibrium_steps` steps boid $i$ had at least one"
                r" neighbour and $|v_i - v_j| < \epsilon \max(|v_i|, |v_j|)$ for all"
                r" neighbours $j$, else $0$. Neighbours are nearer than `flock_range`,"
                r" and $\epsilon$ is `equilibrium_tolerance`."
            ),
        ),
        "dead_end_time": Metric(
            counted.dead_end_time,
            unit="time",
            text="time without a free heading, a sum over boids",
            source="rustamani2024, Alg. 7",
            distribution="skewed",
            better="low",
            counts=True,
            low=0.0,
            formula=(
                r"$\Delta t \sum_{k=1}^{K} \sum_{i=1}^{N} b_i(k)$ over the $K$ steps"
                r" done, where $b_i(k) = 1$ if boid $i$ looked for a heading free of"
                r" obstacles in step $k$ and found none, else $0$."
            ),
        ),
        "herded": Metric(
            herd.herded,
            unit="",
            text="1 once the dog has brought the sheep to the goal, else 0",
            source=_STROMBOM,
            distribution="proportion",
            state=("task_time",),
            kinds=_HERD,
            formula=(
                r"$1$ if after this or an earlier step $|p_i - g| < R$ for all sheep"
                r" $i$, or $|\bar p_S - g| < R$ if `done_when` is `centre`, else $0$."
                r" $\bar p_S$ is the mean position of the sheep, $g$ the goal, and $R$"
                r" `target_radius`."
            ),
        ),
        "herding_time": Metric(
            herd.herding_time,
            unit="time",
            text="time at which the dog had brought the sheep to the goal",
            source=_STROMBOM,
            distribution="skewed",
            better="low",
            state=("task_time",),
            kinds=_HERD,
            low=0.0,
            formula=(
                r"$k \Delta t$, where $k$ is the first step after which `herded` is"
                r" $1$. NaN before."
            ),
        ),
        "herd_radius": Metric(
            herd.herd_radius,
            unit="length",
            text="mean distance of the sheep from their centre of mass",
            source=_STROMBOM,
            distribution="skewed",
            better="low",
            kinds=_HERD,
            low=0.0,
            formula=(
                r"$\frac{1}{|S|} \sum_{i \in S} |p_i - \bar p_S|$, where $S$ are the"
                r" sheep and $\bar p_S$ is their mean position. NaN without sheep."
            ),
        ),
        "herd_goal_distance": Metric(
            herd.herd_goal_distance,
            unit="length",
            text="distance of the centre of mass of the sheep from the goal",
            source=_STROMBOM,
            distribution="skewed",
            better="low",
            kinds=_HERD,
            demands=(_GOAL,),
            low=0.0,
            formula=(
                r"$|\bar p_S - g|$, where $\bar p_S$ is the mean position of the sheep"
                r" and $g$ the goal, or the last of several. NaN without sheep."
            ),
        ),
        "dog_offset": Metric(
            herd.dog_offset,
            unit="length",
            text="distance of the dog, anticlockwise from the line from goal to sheep",
            source=_STROMBOM,
            distribution="normal",
            better="neither",
            kinds=_HERD,
            demands=(_GOAL,),
            formula=(
                r"$\frac{u_x q_y - u_y q_x}{|u|}$ with $u = \bar p_S - g$ and"
                r" $q = p_D - g$, where $p_D$ is the position of the dog, $\bar p_S$"
                r" the mean position of the sheep, and $g$ the goal, or the last of"
                r" several. NaN for $u = 0$ and without sheep or dog."
            ),
        ),
        "dog_distance": Metric(
            herd.dog_distance,
            unit="length",
            text="distance of the dog from the centre of mass of the sheep",
            source="Jadhav et al. (2024)",
            distribution="skewed",
            better="neither",
            kinds=_HERD,
            low=0.0,
            formula=(
                r"$|p_D - \bar p_S|$, where $p_D$ is the position of the dog and"
                r" $\bar p_S$ the mean position of the sheep; the mean over dogs if"
                r" there are several. NaN without sheep or dog."
            ),
        ),
    },
    derive=_of_part,
)
