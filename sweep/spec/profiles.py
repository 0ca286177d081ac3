"""The profiles that a study records: metrics with values along an axis."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.model import WORKING, Model
from kernels.profiles import PROFILES
from sweep.spec.contents import Content, ListOf, Number, Text, Whole
from sweep.spec.document import Entry
from sweep.spec.keys import Key, differing, read_section, section_schema
from sweep.spec.schema_parts import Schema
from sweep.text import unknown

MOST_BINS = 1000
USUAL_BINS = 30
"""Values along an axis that a spec does not divide; boxes have fewer."""
ANY_PROFILE = next(iter(PROFILES))
"""A profile for examples."""


class ProfilePoint(NamedTuple):
    """A position on the axis of a profile, at which a trial has a value.

    Attributes
    ----------
    profile : str
        Name of the profile.
    at : float
        Position in the unit of the axis.
    """

    profile: str
    at: float

    def __str__(self) -> str:
        return f"{self.profile} at {self.at:.12g}"

    def of(self, positions: NDArray[np.float64], values: NDArray[np.float64]) -> float:
        """Return the value at the position, on a straight line between two neighbours.

        Parameters
        ----------
        positions : array of float, shape (K,)
            Positions along the axis, ascending.
        values : array of float, shape (K,)

        Returns
        -------
        float
            NaN beyond the positions, and where a neighbour has no value.
        """
        if not len(positions):
            return math.nan
        nothing = math.nan
        return float(np.interp(self.at, positions, values, left=nothing, right=nothing))


@dataclass(frozen=True)
class RecordedProfile:
    """Name of a profile, and the extent of the axis."""

    name: Annotated[
        str,
        Key(
            Text("the name of a profile"),
            "name of the profile (`sweep metrics`)",
            example=ANY_PROFILE,
        ),
    ]
    to: Annotated[
        float | None,
        Key(
            Number(above=0, below=1e100),
            "end of the axis: a distance, a time, or a wave number",
            otherwise="half of the shorter side of the world, a quarter of the"
            " averaged time, or the wave number of `bins` waves in the longer side",
            example="20",
        ),
    ] = None
    bins: Annotated[
        int | None,
        Key(
            Whole(1, MOST_BINS),
            "number of values along the axis",
            otherwise="30, or 9 for boxes",
            example="40",
        ),
    ] = None


@dataclass(frozen=True)
class ProfileOf(Content[RecordedProfile]):
    """Name of a profile, or a mapping with the name and the extent of the axis."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "the name of a profile, or {name: ..., to: ..., bins: ...}"

    def read(self, entry: Entry) -> RecordedProfile:
        """Return the profile of an entry, or raise SpecError."""
        if isinstance(entry.value, dict):
            return read_section(RecordedProfile, entry)
        return RecordedProfile(entry.text())

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return {"anyOf": [{"type": "string"}, section_schema(RecordedProfile)]}

    def write(self, value: RecordedProfile) -> Any:
        """Return a profile as a spec has it."""
        fields = differing(value)
        return fields if len(fields) > 1 else value.name

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """Classes whose keys may appear below this key."""
        return (RecordedProfile,)


PROFILE_NAMES = ListOf(ProfileOf(), "profiles (`sweep metrics`)")


def written_profiles(profiles: tuple[RecordedProfile, ...]) -> Any:
    """Return profiles as a spec has them."""
    return PROFILE_NAMES.write(profiles)


def check_profile(
    entry: Entry, recorded: RecordedProfile, catalogue: Catalogue, model: Model
) -> None:
    """Raise SpecError if a profile or the kind of boids is unknown.

    Parameters
    ----------
    entry : Entry
        The error has the line of this entry.
    recorded : RecordedProfile
    catalogue : Catalogue
        Profiles and metrics by name.
    model : Model
    """
    name = recorded.name
    if name in catalogue.metrics:
        raise entry.error(f'"{name}" has no axis: list it under "metrics"')
    if name not in catalogue.profiles:
        raise entry.error(unknown("profile", name, catalogue.profiles))
    profile = catalogue.profiles[name]
    if profile.part not in ("", WORKING, *model.kinds):
        raise entry.error(
            f'profile "{name}" needs a model with the kind {profile.part}'
        )
    if profile.axis == "box side" and recorded.to is not None:
        reason = f'"to" has no effect on {name}: boxes divide the world'
        raise entry.error(f"{reason}; remove the key")
    if profile.axis == "individual" and recorded.bins is not None:
        reason = f'"bins" has no effect on {name}, which has a value per individual'
        raise entry.error(f"{reason}; remove the key")
