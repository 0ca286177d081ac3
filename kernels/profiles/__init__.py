"""Profiles: metrics of a trial with a value at each position along an axis.

The axis is a distance, a lag, a wave number, the side of a box, or the individual. A
profile is a kernel `(passage, axis, values)` that reads the positions of all boids in
the averaged frames. To add a profile, write a kernel and enter the kernel in PROFILES.

pairs    correlation and density over the distance of two boids
density  waves, and numbers of boids in boxes
motion   displacement and neighbours over time, delays between boids
passage  types: a profile, and the input of profiles
"""

from collections.abc import Iterable, Mapping

from kernels.metrics.parts import of_any_model, split_name
from kernels.profiles import density, motion, pairs
from kernels.profiles.passage import (
    BINNED,
    PROFILE_UNITS,
    Axis,
    Passage,
    Profile,
)
from kernels.registry import Registry

__all__ = [
    "BINNED",
    "PROFILES",
    "PROFILE_UNITS",
    "Axis",
    "Passage",
    "Profile",
    "of_part",
]


def of_part(
    name: str, profiles: Mapping[str, Profile], kinds: Iterable[str]
) -> Profile | None:
    """Return the profile of a part of the boids that a name denotes, or None.

    Parameters
    ----------
    name : str
        Name such as "pair_distribution_of_sheep".
    profiles : mapping of str to Profile
    kinds : iterable of str
        Kinds of boids; each kind is a part.
    """
    profile: Profile | None = split_name(name, profiles, kinds)
    return profile


def _of_part(name: str) -> Profile | None:
    profile: Profile | None = of_any_model(name, PROFILES, of_part)
    return profile


PROFILES = Registry(
    "boidsweep.profiles",
    Profile,
    {
        "pair_distribution": Profile(
            pairs.pair_distribution,
            axis="distance",
            unit="",
            text="density of boids at a distance from a boid, relative to the world's",
            source="Hansen and McDonald (2013)",
            low=0.0,
            formula=(
                r"$g(r) = \frac{A}{2 \pi r \, \Delta r} \frac{\langle P(r)"
                r" \rangle}{\frac{1}{2} N (N - 1)}$, where $P(r)$ is the number of"
                r" pairs with a distance in a bin of width $\Delta r$ around $r$, and"
                r" $A$ is the area of the world. $g = 1$ for independent boids on a"
                r" torus."
            ),
        ),
        "velocity_correlation_function": Profile(
            pairs.velocity_correlation_function,
            axis="distance",
            unit="",
            text="correlation of two deviations from the mean velocity, by distance",
            source="Cavagna et al. (2010)",
            zero=True,
            formula=(
                r"$C(r) = \left\langle \frac{u_i \cdot u_j}{\frac{1}{N} \sum_k"
                r" |u_k|^2} \right\rangle$ over pairs with $|p_i - p_j| \approx r$ and"
                r" frames, with $u_i = v_i - \frac{1}{N} \sum_k v_k$. The smallest"
                r" $r$ with $C(r) = 0$ is the correlation length."
            ),
        ),
        "structure_factor": Profile(
            density.structure_factor,
            axis="wave number",
            unit="",
            text="power of waves of density, per boid",
            source="Hansen and McDonald (2013)",
            low=0.0,
            formula=(
                r"$S(k) = \left\langle \frac{1}{N} \left| \sum_{i=1}^{N}"
                r" e^{-i q \cdot p_i} \right|^2 \right\rangle$ over waves $q$ that fit"
                r" into the world with $|q| \approx k$, and frames."
            ),
        ),
        "number_fluctuations": Profile(
            density.number_fluctuations,
            axis="box side",
            unit="boids",
            text="standard deviation of the number of boids in a box",
            source="Narayan et al. (2007)",
            exponent=0.5,
            low=0.0,
            formula=(
                r"$\Delta n = \sqrt{\langle (n - \langle n \rangle)^2 \rangle}$ over"
                r" equal boxes that divide the world, and frames. The exponent"
                r" $\alpha$ of $\Delta n \sim \langle n \rangle^\alpha$ is half of the"
                r" slope over the side of a box; $\alpha = \frac{1}{2}$ for"
                r" independent boids."
            ),
        ),
        "mean_squared_displacement": Profile(
            motion.mean_squared_displacement,
            axis="lag",
            unit="length^2",
            text="mean square of the distance that a boid covers in a time",
            source="Cavagna et al. (2013)",
            exponent=1.0,
            low=0.0,
            formula=(
                r"$\langle |p_i(t + \tau) - p_i(t)|^2 \rangle$ over boids and times"
                r" $t$. The exponent is 1 for diffusion, and 2 for a straight way."
            ),
        ),
        "neighbour_overlap": Profile(
            motion.neighbour_overlap,
            axis="lag",
            unit="",
            text="share of the 6 nearest neighbours that are nearest later, too",
            source="Cavagna et al. (2013)",
            low=0.0,
            high=1.0,
            formula=(
                r"$Q(\tau) = \left\langle \frac{1}{6} |M_i(t) \cap M_i(t + \tau)|"
                r" \right\rangle$ over boids and times $t$, where $M_i(t)$ are the 6"
                r" nearest neighbours of boid $i$."
            ),
        ),
        "directional_delay": Profile(
            motion.directional_delay,
            axis="individual",
            unit="time",
            text="mean delay with which others turn into the heading of a boid",
            source="Nagy et al. (2010)",
            in_time=True,
            formula=(
                r"$\frac{1}{N - 1} \sum_{j \neq i} \tau_{ij}$, where $\tau_{ij}$ is"
                r" the $\tau$ with the largest $\langle \hat{v}_i(t) \cdot"
                r" \hat{v}_j(t + \tau) \rangle$. A boid that leads has a delay above"
                r" $0$."
            ),
        ),
    },
    derive=_of_part,
)
"""All profiles by name."""
