"""The recorded values of trials, which ids of trials cover.

Trials that differ only in the recording are one simulation run. Values in the two
recordings are bitwise identical.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any, NamedTuple

from sweep.design.code import study_code
from sweep.spec import LAST_FLOCKS, LAST_STATES, RecordedProfile, RecordSpec, Study

LATER = (LAST_STATES, LAST_FLOCKS)
"""Keys of later versions; ids cover a key only if the value is true."""


class Recording(NamedTuple):
    """Recorded values of trials.

    Attributes
    ----------
    stamps : mapping of str
        Code hashes of the measured metrics, by name.
    content : mapping
        Content of `record` that ids cover, ready for JSON.
    """

    stamps: Mapping[str, str]
    content: Mapping[str, Any]

    @classmethod
    def of(cls, study: Study) -> "Recording":
        """Return the recording of the trials of a study."""
        return cls(study_code(study).metrics, recorded_content(study.record))

    def covers(self, other: "Recording") -> bool:
        """Return whether this recording has all values of `other`, by equal code."""
        mine = self.content
        theirs = other.content
        derived = mine.get("derive", {})
        return (
            mine["every"] == theirs["every"]
            and set(self.shared(other)) >= set(theirs["metrics"])
            and set(mine["series"]) >= set(theirs["series"])
            and mine["heatmaps"] >= theirs["heatmaps"]
            and mine["trajectories"] >= theirs["trajectories"]
            and all(mine.get(key, False) >= theirs.get(key, False) for key in LATER)
            and self._profiles(other) == theirs.get("profiles", {})
            and derived.items() >= theirs.get("derive", {}).items()
        )

    def _profiles(self, other: "Recording") -> dict[str, Any]:
        """Return the axes of the profiles in common, with equal code."""
        mine: Mapping[str, Any] = self.content.get("profiles", {})
        return {
            name: mine[name]
            for name in other.content.get("profiles", {})
            if name in mine and self.stamps.get(name) == other.stamps.get(name)
        }

    def shared(self, other: "Recording") -> list[str]:
        """Return the measured metrics in common, with equal code and frames."""
        if self.content["every"] != other.content["every"]:
            return []
        return [
            name
            for name in self.content["metrics"]
            if name in other.content["metrics"]
            and self.stamps.get(name) == other.stamps.get(name)
        ]


def profile_content(profiles: Iterable[RecordedProfile]) -> dict[str, Any]:
    """Return the extent of the axis of each profile, by name, ready for JSON."""
    return {recorded.name: [recorded.to, recorded.bins] for recorded in profiles}


def recorded_content(record: RecordSpec) -> dict[str, Any]:
    """Return the content of `record` that ids cover.

    The order of metrics makes no difference.
    """
    content = asdict(replace(record, derive=())) | {
        "metrics": sorted(record.metrics),
        "series": sorted(record.series),
        "derive": {metric.name: metric.expression.text for metric in record.derive},
    }
    content["profiles"] = profile_content(record.profiles)
    # Trials without keys of later versions keep the earlier ids.
    for key in ("derive", "profiles"):
        if not content[key]:
            del content[key]
    for key in LATER:
        if not content[key]:
            del content[key]
    return content
