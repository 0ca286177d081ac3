"""Record of a study in the metadata of the plan, written and read only here."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pyarrow as pa

from sweep.spec import Axis, Study, by_design, continued_axis, sections
from sweep.store.origin import PROVENANCE

OPTIONAL = (
    "series",
    "tables",
    "designs",
    "continued",
    "details",
)
"""Entries that a plan may lack."""


@dataclass(frozen=True)
class AxisAbout:
    """The parameters and the sampler of an axis.

    A sample that is read in blocks has the `size` and the `levels` of the blocks.
    `rows` has the distinct row of each row of the sample, if equal rows are merged.
    """

    settings: list[str]
    sampler: str | None
    size: int = 1
    levels: int | None = None
    rows: list[int] | None = None

    @classmethod
    def of(cls, axis: Axis) -> "AxisAbout":
        """Return the record of an axis of a spec."""
        settings = list(axis.columns)
        if axis.blocks is None or axis.rows is None:
            return cls(settings, axis.sampler)
        rows = axis.rows.tolist() if axis.merged else None
        return cls(
            settings,
            axis.sampler,
            size=axis.blocks.size,
            levels=axis.blocks.levels,
            rows=rows,
        )

    @classmethod
    def read(cls, stored: Mapping[str, Any]) -> "AxisAbout":
        """Return the record from a stored plan with a checked shape."""
        return cls(
            stored["fields"],
            stored["sampler"],
            size=stored.get("size", 1),
            levels=stored.get("levels"),
            rows=stored.get("rows"),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the record as plans store it."""
        stored: dict[str, Any] = {"fields": self.settings, "sampler": self.sampler}
        if self.size > 1:
            stored |= {"size": self.size, "levels": self.levels}
        return stored | ({} if self.rows is None else {"rows": self.rows})


@dataclass(frozen=True)
class PlanAbout:
    """Record of a study in the plan.

    Attributes
    ----------
    varied : list of str
        Parameters that differ between points, in the order of the columns.
    record : list of str
        Recorded metrics.
    maps : dict
        Custom maps of the spec, in the format of `OwnMap.as_json`.
    ablated : dict
        Groups of parameters, the components, by ablated preset, or by axis if the spec
        names the components.
    axes : dict or None
        Sample of each axis; None in plans before 0.2.
    designs : list of list of str, optional
        Names of the axes of each design, if several designs are united.
    series : list of str, optional
        Metrics that are recorded in each frame; None in plans up to 0.9.
    tables : list of str, optional
        Stored tables; None in plans up to 0.9.
    continued : dict, optional
        Name of the continued axis, and the directions of the chains.
    sections : mapping
        Records of the sections of methods, by key.
    details : list of str, optional
        Names that the spec gives to components.
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
        """Return the record of a study.

        Parameters
        ----------
        study : Study
        varied : iterable of str
            Parameters that differ between points, in the order of the columns.
        axes : iterable of Axis
            Axes of the study.
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
                name: recorded(study, value)
                for name, value in study.sections.items()
                if (recorded := sections()[name].recorded)
            },
            designs=united if len(united) > 1 else None,
            series=list(study.record.series),
            tables=list(study.record.tables),
            continued=_chained(axes),
            details=[name for axis in axes for name in axis.named] or None,
        )

    @classmethod
    def read(cls, provenance: Mapping[str, Any]) -> "PlanAbout":
        """Return the record from the checked metadata of a plan."""
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
                name: provenance[name]
                for name, section in sections().items()
                if section.recorded and name in provenance
            },
            details=provenance.get("details"),
        )

    def into(self, plan: pa.Table, origin: Mapping[str, object]) -> pa.Table:
        """Return the plan with the record and the origin in its metadata.

        Parameters
        ----------
        plan : Table
        origin : mapping
            Origin of the plan.

        Raises
        ------
        ValueError
            If a section has the key of another entry.
        """
        entries = dict(origin) | {
            "varied": self.varied,
            "record": self.record,
            "maps": self.maps,
            "ablated": self.ablated,
            "axes": {name: axis.as_json() for name, axis in (self.axes or {}).items()},
        }
        for name in OPTIONAL:
            if getattr(self, name) is not None:
                entries[name] = getattr(self, name)
        if taken := entries.keys() & self.sections.keys():
            raise ValueError(f"reserved for the plan: {', '.join(sorted(taken))}")
        entries |= self.sections
        text = json.dumps(entries, sort_keys=True)
        return plan.replace_schema_metadata({PROVENANCE: text.encode()})


def _chained(axes: Iterable[Axis]) -> dict[str, Any] | None:
    """Return the continued axis, and the directions of the chains.

    Returns None if no axis is continued.
    """
    axis = continued_axis(axes)
    if axis is None or axis.continued is None:
        return None
    return {"axis": axis.name, "directions": list(axis.continued.directions)}
