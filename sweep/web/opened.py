"""A spec that was opened on the page.

The text stays unchanged, with comments, except for the changes made on the page.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML

from kernels.catalogue import Catalogue
from sweep.design import Design, Job, Jobs, expand
from sweep.errors import SpecError
from sweep.own_code import study_with
from sweep.spec import Axis, Place, Study, Value
from sweep.text import unknown

WIDTH = 110


class Edits(NamedTuple):
    """Changes that were made on the page.

    Attributes
    ----------
    settings : mapping
        Parameters with a changed value.
    shown : mapping
        The value of every parameter.
    maps : mapping
        Custom maps that were drawn.
    sweeps : mapping
        Entries of parameters that are to be swept.
    seed : int or None
        A new seed, None for an unchanged seed.
    record : tuple of str
        Additional metrics to record.
    written : callable
        Returns the text for a value of a parameter, or for a metric, by name and value.
    """

    settings: Mapping[str, Value]
    shown: Mapping[str, Value]
    maps: Mapping[str, Any]
    sweeps: Mapping[str, Any]
    seed: int | None
    record: tuple[str, ...]
    written: Callable[[str, Any], Any]


@dataclass(frozen=True, eq=False)
class OpenedSpec:
    """A study with the points, and the shown trial."""

    study: Study
    design: Design
    point: int = 0
    replicate: int = 0

    @property
    def replicates(self) -> int:
        """The number of trials per point; the largest number if a rule adds trials."""
        return self.study.trials_per_point

    @property
    def job(self) -> Job:
        """The trial that is shown."""
        index = self.point * self.replicates + self.replicate
        return Jobs(self.study, self.design)[index]

    def at(self, point: int, replicate: int) -> "OpenedSpec":
        """Return this spec at another trial.

        Parameters
        ----------
        point : int
            Index of the point.
        replicate : int
            Number of the replicate, from 0.

        Raises
        ------
        SpecError
            If the spec does not have this trial.
        """
        for name, number, count in (
            ("point", point, self.design.n_points),
            ("replicate", replicate, self.replicates),
        ):
            if number >= count:
                raise SpecError(f"{name}: {number:,} is not in 0 to {count - 1:,}")
        return replace(self, point=point, replicate=replicate)

    def having(self, name: str, value: Value) -> "OpenedSpec":
        """Return the spec at the point that has this value of a parameter.

        Among several points, the method chooses the point that has most values in
        common with the shown point.

        Parameters
        ----------
        name : str
            Parameter that varies.
        value : int, float, str or bool
            Value of the parameter.

        Raises
        ------
        SpecError
            If no point has this value, or the parameter does not vary.
        """
        point = point_having(self.design.columns, self.point, name, value)
        return self.at(point, self.replicate)

    def text(self, edits: Edits) -> str:
        """Return the YAML of the spec with the changes.

        Entries that contradict the changes are removed. The first candidates are the
        axes of a parameter that has a single value now. If the points would not contain
        the shown point, the derived parameters are removed too. If the point is still
        missing, the whole design is removed.
        """
        touched = {*edits.settings, *edits.sweeps}
        axes = [axis for axis in self.study.axes if touched & axis.columns.keys()]
        if axes and any(axis.design for axis in self.study.axes):
            axes = [*self.study.axes]  # a design of several has no separate point
        derived = {*self.study.derive}
        text = self._written(edits, axes, touched & derived)
        if not edits.sweeps and not self._has(text, edits.shown):
            text = self._written(edits, axes, derived)
        if not edits.sweeps and not self._has(text, edits.shown):
            text = self._written(edits, self.study.axes, derived, require=False)
        return text

    def _has(self, text: str, shown: Mapping[str, Value]) -> bool:
        """Return whether a spec has a point with these parameters."""
        try:
            design = expand(study_with(text, self.study.path, self.study.catalogue))
        except SpecError:
            return False
        fits = np.ones(design.n_points, np.bool_)
        for name, column in design.columns.items():
            fits &= column == shown[name]
        return bool(fits.any()) and all(
            design.base[name] == shown[name]
            for name in design.base.keys() - design.columns.keys()
        )

    def _written(
        self,
        edits: Edits,
        axes: Collection[Axis],
        underived: Iterable[str],
        *,
        require: bool = True,
    ) -> str:
        """Return the text with shown values in place of axes and derived names."""
        yaml = YAML()
        yaml.preserve_quotes = True
        yaml.default_flow_style = None  # of what is added: short lists stay in a line
        yaml.width = WIDTH
        root = yaml.load(self.study.text)
        gone: list[Place] = [("derive", name) for name in underived]
        gone += [("fixed", name) for name in edits.sweeps]
        gone += [] if require else [("require",)]
        several = len(axes) == len(self.study.axes)
        places = [axis.place[:1] if several else axis.place for axis in axes]
        gone += dict.fromkeys(places)
        for place in gone:
            _remove(root, place)
        names = {*underived, *edits.settings}.union(*(axis.columns for axis in axes))
        fixed = {name: edits.shown[name] for name in edits.shown if name in names}
        for key, content in (
            ("maps", edits.maps),
            ("fixed", {name: edits.written(name, fixed[name]) for name in fixed}),
            ("sweep", edits.sweeps),
        ):
            if content:
                root.setdefault(key, {}).update(content)
        for name in edits.sweeps:
            _remove(root, ("fixed", name))
        if edits.seed is not None:
            listed = self.study.seeds is not None
            root["seeds" if listed else "seed"] = [edits.seed] if listed else edits.seed
        if edits.record:
            record = root.setdefault("record", {})
            metrics = [edits.written("metrics", name) for name in edits.record]
            record["series"] = [*record.get("series", ()), *metrics]
        stream = StringIO()
        yaml.dump(root, stream)
        return stream.getvalue()


def point_having(
    columns: Mapping[str, NDArray[Any]], point: int, name: str, value: Value
) -> int:
    """Return the index of the point that has this value of a parameter.

    Among several points, the function chooses the point that has most values in common
    with `point`.

    Parameters
    ----------
    columns : mapping of str to array (P,)
        Values of each parameter that varies, one per point.
    point : int
        Index of the point to compare with.
    name : str
        Parameter that varies.
    value : int, float, str or bool
        Value of the parameter.

    Raises
    ------
    SpecError
        If no point has this value, or the parameter does not vary.
    """
    if name not in columns:
        raise SpecError(unknown("varying parameter", name, columns))
    fits = columns[name] == value
    if not fits.any():
        raise SpecError(f"{name}: no point has {value}")
    alike = sum((column == column[point]).astype(int) for column in columns.values())
    return int(np.argmax(np.where(fits, alike, -1)))


def opened(study: Study) -> OpenedSpec:
    """Return the opened spec of a study, at the first trial."""
    return OpenedSpec(study, expand(study))


def opened_again(
    yaml: str, point: str, replicate: int, catalogue: Catalogue, path: Path
) -> OpenedSpec:
    """Return an opened spec at the trial that a page has kept.

    Parameters
    ----------
    yaml : str
        Text of the spec.
    point : str
        Id of the point; "" for the first trial.
    replicate : int
        Number of the replicate, from 0.
    catalogue : Catalogue
        Models, metrics and maps by name.
    path : Path
        File of the spec, real or not, for relative paths and errors.

    Raises
    ------
    SpecError
        If the spec is not valid, or does not have the trial.
    """
    spec = opened(study_with(yaml, path, catalogue))
    if not point:
        return spec
    points = Jobs(spec.study, spec.design).points
    if point not in points or replicate >= spec.replicates:
        raise SpecError(f"the spec has no point {point} with replicate {replicate}")
    return spec.at(points.index(point), replicate)


def _remove(root: Any, place: Place) -> None:
    """Remove an entry of a mapping, and the mapping if the entry is the last."""
    *above, key = place
    holder = root
    for part in above:
        holder = holder.get(part, {})
    holder.pop(key, None)
    if above and not holder:
        _remove(root, tuple(above))
