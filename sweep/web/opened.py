"""A spec that was opened on the page. Its text stays what it was but for what was
changed on the page; comments stay too.
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
from sweep.design.design import Design, expand
from sweep.design.jobs import Job, Jobs
from sweep.errors import SpecError
from sweep.own_code.reading import study_with
from sweep.spec.axes import Axis
from sweep.spec.document import Place
from sweep.spec.settings import Value
from sweep.spec.study import Study
from sweep.text import unknown

WIDTH = 110


class Edits(NamedTuple):
    """What was changed on the page.

    settings  those that have another value
    shown     the value of every setting
    maps      maps of its own that were drawn
    sweeps    the entries of settings that are to be swept
    seed      another seed, None for the same
    record    metrics that are to be recorded too
    written   the text that stands for a value of a setting or for a metric
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
    """A study with its points, and which of its trials is shown."""

    study: Study
    design: Design
    point: int = 0
    replicate: int = 0

    @property
    def replicates(self) -> int:
        """The trials of a point; the most where a rule adds them."""
        return self.study.trials_per_point

    @property
    def job(self) -> Job:
        """The trial that is shown."""
        place = self.point * self.replicates + self.replicate
        return Jobs(self.study, self.design)[place]

    def at(self, point: int, replicate: int) -> "OpenedSpec":
        """The same spec at another trial. Raises SpecError where it has none there."""
        for name, number, count in (
            ("point", point, self.design.n_points),
            ("replicate", replicate, self.replicates),
        ):
            if number >= count:
                raise SpecError(f"{name}: there is no {number:,}; 0 to {count - 1:,}")
        return replace(self, point=point, replicate=replicate)

    def having(self, name: str, value: Value) -> "OpenedSpec":
        """The spec at the point that has this value of a setting, and the most values
        of this point otherwise. Raises SpecError where there is none.
        """
        point = point_having(self.design.columns, self.point, name, value)
        return self.at(point, self.replicate)

    def text(self, edits: Edits) -> str:
        """The YAML of the spec with these changes. What they contradict gives way: the
        axes of a setting that has one value now; where the shown point would not be
        among the points, what is derived too; and if that is not enough, the whole
        design.
        """
        touched = {*edits.settings, *edits.sweeps}
        axes = [axis for axis in self.study.axes if touched & axis.columns.keys()]
        if axes and any(axis.design for axis in self.study.axes):
            axes = [*self.study.axes]  # one of several designs has no point of its own
        derived = {*self.study.derive}
        text = self._written(edits, axes, touched & derived)
        if not edits.sweeps and not self._has(text, edits.shown):
            text = self._written(edits, axes, derived)
        if not edits.sweeps and not self._has(text, edits.shown):
            text = self._written(edits, self.study.axes, derived, require=False)
        return text

    def _has(self, text: str, shown: Mapping[str, Value]) -> bool:
        """Whether a spec has a point with these settings."""
        try:
            design = expand(study_with(text, self.study.path, self.study.known))
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
        """The text in which these axes, and what is derived of these names, have given
        way to the values that are shown.
        """
        yaml, stream = YAML(), StringIO()
        yaml.preserve_quotes, yaml.width = True, WIDTH
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
        yaml.dump(root, stream)
        return stream.getvalue()


def point_having(
    columns: Mapping[str, NDArray[Any]], point: int, name: str, value: Value
) -> int:
    """The number of the point that has this value of a setting, and the most values of
    `point` otherwise; `columns` (P,) are the values of what varies. Raises SpecError
    where there is none.
    """
    if name not in columns:
        raise SpecError(unknown("setting that varies", name, columns))
    fits = columns[name] == value
    if not fits.any():
        raise SpecError(f"{name}: no point has {value}")
    alike = sum((column == column[point]).astype(int) for column in columns.values())
    return int(np.argmax(np.where(fits, alike, -1)))


def opened(study: Study) -> OpenedSpec:
    """A study from its first trial."""
    return OpenedSpec(study, expand(study))


def opened_again(
    yaml: str, point: str, replicate: int, known: Catalogue, path: Path
) -> OpenedSpec:
    """A spec as if it stood in the file `path`, at the trial with this id of its point.
    Raises SpecError where it cannot be read.
    """
    spec = opened(study_with(yaml, path, known))
    points = Jobs(spec.study, spec.design).points
    there = point in points and replicate < spec.replicates
    return spec.at(points.index(point), replicate) if there else spec


def _remove(root: Any, place: Place) -> None:
    """Remove what stands in a mapping, and the mapping if it holds nothing else."""
    *above, key = place
    holder = root
    for part in above:
        holder = holder.get(part, {})
    holder.pop(key, None)
    if above and not holder:
        _remove(root, tuple(above))
