"""What trials record, as their ids cover it. Two trials that differ in nothing else are
the same flight: what both record is equal, to the last bit.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, NamedTuple

from sweep.design.code import study_code
from sweep.spec.study import LAST_FLOCKS, LAST_STATES, RecordSpec, Study

LATER = (LAST_STATES, LAST_FLOCKS)
"""Keys that came later; ids cover them only where they are true."""


class Recording(NamedTuple):
    """The `stamps` of the metrics that are measured, by name, and the `content` of
    `record` that ids cover, ready for JSON.
    """

    stamps: Mapping[str, str]
    content: Mapping[str, Any]

    @classmethod
    def of(cls, study: Study) -> "Recording":
        """What the trials of a study record."""
        return cls(study_code(study).metrics, recorded_content(study.record))

    def covers(self, asked: "Recording") -> bool:
        """Whether it has all that is asked for, from the same code."""
        mine, theirs = self.content, asked.content
        derived = mine.get("derive", {})
        return (
            mine["every"] == theirs["every"]
            and set(self.shared(asked)) >= set(theirs["metrics"])
            and set(mine["series"]) >= set(theirs["series"])
            and mine["heatmaps"] >= theirs["heatmaps"]
            and mine["trajectories"] >= theirs["trajectories"]
            and all(mine.get(key, False) >= theirs.get(key, False) for key in LATER)
            and derived.items() >= theirs.get("derive", {}).items()
        )

    def shared(self, other: "Recording") -> list[str]:
        """The measured metrics that both have, from the same code and frames."""
        if self.content["every"] != other.content["every"]:
            return []
        return [
            name
            for name in self.content["metrics"]
            if name in other.content["metrics"]
            and self.stamps.get(name) == other.stamps.get(name)
        ]


def recorded_content(record: RecordSpec) -> dict[str, Any]:
    """What ids cover of `record`; the order of metrics is none of it."""
    content = asdict(replace(record, derive=())) | {
        "metrics": sorted(record.metrics),
        "series": sorted(record.series),
        "derive": {one.name: one.expression.text for one in record.derive},
    }
    # Trials without what came later keep the ids they had.
    if not record.derive:
        del content["derive"]
    for key in LATER:
        if not content[key]:
            del content[key]
    return content
