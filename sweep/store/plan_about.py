"""What a plan records of its study beside the trials: written and read here alone."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pyarrow as pa

from sweep.spec.axes import Axis, by_design
from sweep.spec.continued_checks import continued_axis
from sweep.spec.study import Study, sections
from sweep.store.origin import PROVENANCE

OPTIONAL = (
    "series",
    "tables",
    "designs",
    "continued",
    "details",
)
"""What only some plans have."""


@dataclass(frozen=True)
class AxisAbout:
    """The settings of an axis, and what sampled them.

    A sample that is read in blocks has their `size` and `levels`; `rows` says which row
    of the sample each point is, where equal points are one.
    """

    settings: list[str]
    sampler: str | None
    size: int = 1
    levels: int | None = None
    rows: list[int] | None = None

    @classmethod
    def of(cls, axis: Axis) -> "AxisAbout":
        """What is recorded of an axis of a spec."""
        settings = list(axis.columns)
        if axis.blocks is None or axis.rows is None:
            return cls(settings, axis.sampler)
        rows = axis.rows.tolist() if axis.merged else None
        return cls(settings, axis.sampler, axis.blocks.size, axis.blocks.levels, rows)

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> "AxisAbout":
        """The same from a stored plan, whose shape has been checked."""
        return cls(
            stored["fields"],
            stored["sampler"],
            stored.get("size", 1),
            stored.get("levels"),
            stored.get("rows"),
        )

    def as_json(self) -> dict[str, Any]:
        """As plans store it."""
        about: dict[str, Any] = {"fields": self.settings, "sampler": self.sampler}
        if self.size > 1:
            about |= {"size": self.size, "levels": self.levels}
        return about | ({} if self.rows is None else {"rows": self.rows})


@dataclass(frozen=True)
class PlanAbout:
    """What a plan records of its study.

    `varied` are the settings that differ between points, in the order of the columns;
    `record` the metrics; `series` those that are kept of each frame, and `tables` the
    tables that are stored, both None in plans up to 0.9; `maps` those that the spec
    brings, as `OwnMap.as_json` writes them; `ablated` the groups of settings of each
    preset that an axis ablates, or of the axis whose `details` the spec names, None
    where it names none; `axes` what each axis samples, None in plans of before 0.2;
    `sections` what the sections of methods record, by key.
    Where several `designs` are united, it has the names of the axes of each. Where an
    axis is continued, `continued` has its name and the directions of its chains.
    """

    varied: list[str]
    record: list[str]
    maps: dict[str, Any]
    ablated: dict[str, Sequence[Sequence[str]]]
    axes: dict[str, AxisAbout] | None
    designs: list[list[str]] | None = None
    series: list[str] | None = None
    tables: list[str] | None = None
    continued: dict[str, Any] | None = None
    sections: Mapping[str, Any] = field(default_factory=dict)
    details: list[str] | None = None

    @classmethod
    def of(
        cls, study: Study, varied: Iterable[str], axes: Iterable[Axis]
    ) -> "PlanAbout":
        """What is recorded of a study.

        study   the study
        varied  the settings that differ between points, in the order of the columns
        axes    its axes
        """
        axes = list(axes)
        united = [[axis.name for axis in design] for design in by_design(axes)]
        return cls(
            varied=list(varied),
            record=list(study.record.names),
            maps={name: own.as_json() for name, own in study.maps.items()},
            ablated={axis.ablated: axis.details for axis in axes if axis.ablated},
            axes={axis.name: AxisAbout.of(axis) for axis in axes},
            sections={
                name: sections()[name].recorded(study, value)
                for name, value in study.sections.items()
            },
            designs=united if len(united) > 1 else None,
            series=list(study.record.series),
            tables=list(study.record.tables),
            continued=_chained(axes),
            details=[name for axis in axes for name in axis.named] or None,
        )

    @classmethod
    def read(cls, provenance: Mapping[str, Any]) -> "PlanAbout":
        """The same from the metadata of a stored plan, whose shape has been checked."""
        axes = provenance.get("axes")
        return cls(
            varied=provenance["varied"],
            record=provenance["record"],
            maps=provenance.get("maps", {}),
            ablated=provenance.get("ablated", {}),
            axes=None
            if axes is None
            else {name: AxisAbout.read(axis) for name, axis in axes.items()},
            designs=provenance.get("designs"),
            series=provenance.get("series"),
            tables=provenance.get("tables"),
            continued=provenance.get("continued"),
            sections={
                name: provenance[name] for name in sections() if name in provenance
            },
            details=provenance.get("details"),
        )

    def into(self, plan: pa.Table, origin: Mapping[str, object]) -> pa.Table:
        """The plan with this, and where it comes from, in its metadata."""
        about = dict(origin) | {
            "varied": self.varied,
            "record": self.record,
            "maps": self.maps,
            "ablated": self.ablated,
            "axes": {name: axis.as_json() for name, axis in (self.axes or {}).items()},
        }
        for name in OPTIONAL:
            if getattr(self, name) is not None:
                about[name] = getattr(self, name)
        if taken := about.keys() & self.sections.keys():
            raise ValueError(f"a plan has these itself: {', '.join(sorted(taken))}")
        about |= self.sections
        text = json.dumps(about, sort_keys=True)
        return plan.replace_schema_metadata({PROVENANCE: text.encode()})


def _chained(axes: Iterable[Axis]) -> dict[str, Any] | None:
    """Which axis is continued, and in which directions."""
    axis = continued_axis(axes)
    if axis is None or axis.continued is None:
        return None
    return {"axis": axis.name, "directions": list(axis.continued.directions)}
