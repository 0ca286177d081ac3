"""Axes of a sweep, each read into a few columns of equal length.

An axis of one parameter has the name of the parameter:

    a parameter   [0.5, 1]
                  {linspace: [a, b, n]}, {logspace: [a, b, n]} or {values: [...]}
                  {uniform: [a, b], points: n}, or another distribution

An axis of several parameters has a free name:

    a free name   {zip: {parameter: list, linspace or logspace, ...}}

                  {sample: random, points: n, parameter: {uniform: [a, b]}, ...}, or
                  another sampler

                  {sample: saltelli, points: n, second_order: false, ...}
                  {sample: morris, points: n, levels: 4, ...}
                  {sample: table, file: gains.csv, columns: [...]}
                  {ablate: another preset}, see sweep.spec.ablation

A mapping may have `when: "condition"`. The axis then applies only under this condition.
The mapping of one parameter may have `continue` and `hold`, see sweep.spec.continuing.
"""

from collections import defaultdict
from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from kernels.catalogue import Catalogue
from sweep.spec.axis_keys import CONTINUE, HOLD, POINTS
from sweep.spec.continuing import Continuation, read_continuation
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.document import Entry, Place
from sweep.spec.evaluation import ExpressionError
from sweep.spec.expressions import CONDITION, Expression, parse
from sweep.spec.limits import MOST_POINTS, check_cells
from sweep.spec.mistakes import Mistakes
from sweep.spec.point_tables import TABLE, read_table
from sweep.spec.samplers import ALONE
from sweep.spec.sampling import Sampler, UnitCube
from sweep.spec.settings import NotAllowedError, Setting, Values, no_setting
from sweep.spec.whole_samples import SampleBlocks, read_blocks
from sweep.text import closest

LOGSPACE = "logspace"
GRIDS: dict[str, Callable[[float, float, int], Values]] = {
    "linspace": np.linspace,
    LOGSPACE: np.geomspace,
}
DIGITS = 12
"""Significant digits of the values of a grid."""


def forms() -> tuple[str, ...]:
    """Return the keys that give the values of one parameter in a mapping."""
    return ("values", *GRIDS, *DISTRIBUTIONS)


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis: distinct points of a few parameters.

    Attributes
    ----------
    name : str
    columns : dict of arrays, shape (len(axis),)
        Values by parameter. All rows are distinct.
    when : Expression, optional
        Condition under which the axis applies.
    place : Place
        Keys that lead to the axis in the spec.
    design : int, default 0
        Number of the design among the designs that the study unites.
    merged : int, default 0
        Number of removed rows, each equal to an earlier row.
    notes : tuple of str
        Remarks for the user.
    ablated : str, optional
        In an ablation study, the second preset, or the name of the axis for named
        components.
    details : tuple of tuple of str
        In an ablation study, the groups of parameters that change together.
    named : tuple of str
        Names of the components, if the spec gives names.
    sampler : str, optional
        Sampler that drew the points.
    blocks : SampleBlocks, optional
        Blocks of a sample whose points come in blocks.
    rows : array of int, optional
        With `blocks`, the row of each point, block after block.
    geometric : bool, default False
        True if the values are at equal ratios.
    continued : Continuation, optional
        Links of the chains of trials along the axis.
    has_base : bool, default False
        True if the first row has the values of `fixed` and of the preset.
    """

    name: str
    columns: dict[str, Values]
    when: Expression | None = None
    place: Place = ()
    design: int = 0
    merged: int = 0
    notes: tuple[str, ...] = ()
    ablated: str | None = None
    details: tuple[tuple[str, ...], ...] = ()
    named: tuple[str, ...] = ()
    sampler: str | None = None
    blocks: SampleBlocks | None = None
    rows: Values | None = None
    geometric: bool = False
    continued: Continuation | None = None
    has_base: bool = False

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))


def by_design(axes: Iterable[Axis]) -> list[tuple[Axis, ...]]:
    """Return the axes of each design of a study, at least one design."""
    designs = defaultdict[int, list[Axis]](list)
    for axis in axes:
        designs[axis.design].append(axis)
    return [tuple(design) for design in designs.values()] or [()]


@dataclass(frozen=True)
class AxisReader:
    """Reader of the axes of a spec.

    Attributes
    ----------
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    model, preset : str
    settings : dict
        The parameters of the model by name.
    seed : int
        Seed of random points.
    folder : Path
        Folder of tables of points.
    samplers : mapping
        Allowed samplers by name.
    keys : container of str
        Keys of a spec, for the error about an unknown parameter.
    """

    catalogue: Catalogue
    model: str
    preset: str
    settings: dict[str, Setting]
    seed: int
    folder: Path
    samplers: Mapping[str, Sampler]
    keys: Container[str]

    def read(self, name: str, entry: Entry) -> Axis:
        """Return an axis of any form except `ablate`.

        Parameters
        ----------
        name : str
            A parameter, or the name of an axis of several parameters.
        entry : Entry

        Returns
        -------
        Axis

        Raises
        ------
        SpecError
            If `entry` is not a valid axis.
        """
        blocks = continued = None
        if isinstance(entry.value, dict) and (
            "sample" in entry.value or "zip" in entry.value
        ):
            if name in self.settings:
                raise entry.error(
                    f'"{name}" is a parameter: an axis of several parameters needs a'
                    " different name"
                )
            blocks = self._blocks(entry)
            columns = (
                self._sample(name, entry, blocks)
                if "sample" in entry.value
                else self._zip(entry)
            )
        elif name in self.settings:
            columns = {name: self._single(self.settings[name], entry)}
            continued = read_continuation(entry)
        else:
            forms = "; to vary several parameters together, use zip, sample or ablate"
            more = "" if closest(name, self.settings) else forms
            raise entry.error(no_setting(name, self.settings, self.keys, more))
        when = self.when(entry)
        distinct, rows = distinct_rows(list(columns.values()))
        merged = len(rows) - len(distinct)
        if merged:
            columns = {setting: column[distinct] for setting, column in columns.items()}
        notes = (*((blocks.note(name),) if blocks else ()), *self._notes(name, entry))
        return Axis(
            name,
            columns,
            when,
            entry.place,
            merged=merged,
            notes=notes,
            sampler=_sampler(entry),
            blocks=blocks,
            rows=rows if blocks else None,
            geometric=isinstance(entry.value, dict) and LOGSPACE in entry.value,
            continued=continued,
        )

    def _notes(self, name: str, entry: Entry) -> tuple[str, ...]:
        sampler = _sampler(entry)
        if sampler is None or sampler not in self.samplers:
            return ()
        remark = self.samplers[sampler].remark(entry.value["points"])
        return (f"{name}: {remark}",) if remark else ()

    def _single(self, setting: Setting, entry: Entry) -> Values:
        if isinstance(entry.value, list):
            return _listed(setting, entry)
        if not isinstance(entry.value, dict):
            raise entry.expected(
                "a list or a mapping (write a single value under fixed)"
            )
        shared = ("when", CONTINUE.name, HOLD.name)
        entry.keys([*forms(), "points", *shared])
        form = next((form for form in forms() if form in entry.value), None)
        if form is None:
            raise entry.error(f'"{setting.name}" needs one of {", ".join(forms())}')
        if form in DISTRIBUTIONS:
            entry.keys([form, "points", *shared], required=["points"])
            name = setting.name
            alone = UnitCube(_points(entry, 1), [name], name, self.seed)
            return _drawn(
                setting, entry.child(form), self.samplers[ALONE].draw(alone)[0]
            )
        entry.keys([form, *shared])
        return (
            _listed(setting, entry.child("values"))
            if form == "values"
            else _grid(setting, entry.child(form))
        )

    def _blocks(self, entry: Entry) -> SampleBlocks | None:
        """Return the blocks of an axis; None if its points do not come in blocks."""
        if entry.value.get("sample") not in [*self.samplers]:
            return None
        sampler = entry.child("sample").text()
        rules = self.samplers[sampler].blocks
        if rules is None:
            return None
        entry.keys(
            [
                "sample",
                "points",
                "when",
                *[key.name for key in rules.options],
                *self.settings,
            ],
            required=["points"],
        )
        number = sum(key in self.settings for key in entry.value)
        return read_blocks(entry, sampler, rules, number)

    def _sample(
        self, name: str, entry: Entry, blocks: SampleBlocks | None
    ) -> dict[str, Values]:
        sampler = entry.child("sample").one_of("sampler", (*self.samplers, TABLE))
        if sampler == TABLE:
            entry.keys(["sample", "file", "columns", "when"], required=["file"])
            return read_table(entry, self.settings, self.folder)
        _check_installed(entry.child("sample"), self.samplers[sampler])
        if blocks is None:
            entry.keys(
                ["sample", "points", "when", *self.settings], required=["points"]
            )
        members = {key: child for key, child in entry.mapping() if key in self.settings}
        if not members:
            raise entry.error(f'"{name}" samples no parameter')
        count = blocks.count if blocks else _points(entry, len(members))
        return self.draw(name, members, count, sampler=sampler, blocks=blocks)

    def draw(
        self,
        name: str,
        members: Mapping[str, Entry],
        count: int,
        *,
        sampler: str = ALONE,
        blocks: SampleBlocks | None = None,
    ) -> dict[str, Values]:
        """Return drawn values by parameter, with repetitions.

        Parameters
        ----------
        name : str
            Name of the axis, which together with the seed decides the draws.
        members : mapping of str to Entry
            The distribution of each parameter.
        count : int
            Number of draws.
        sampler : str, default "random"
        blocks : SampleBlocks, optional
            Blocks of a sample whose points come in blocks.

        Raises
        ------
        SpecError
            If an entry is no distribution, or a parameter does not allow the values.
        """
        distributions = {
            setting: _only(child, DISTRIBUTIONS) for setting, child in members.items()
        }
        unbounded = [
            setting
            for setting, distribution in distributions.items()
            if not DISTRIBUTIONS[distribution.name].bounded
        ]
        cube = UnitCube(count, [*members], name, self.seed, unbounded=unbounded)
        if blocks:
            cube = replace(cube, size=blocks.size, levels=blocks.levels)
        units = self.samplers[sampler].draw(cube)
        columns = dict[str, Values]()
        mistakes = Mistakes()
        for (setting, form), unit in zip(distributions.items(), units, strict=True):
            with mistakes.noted():
                columns[setting] = _drawn(self.settings[setting], form, unit)
        mistakes.check()
        return columns

    def _zip(self, entry: Entry) -> dict[str, Values]:
        entry.keys(["zip", "when"])
        entry.child("zip").keys(self.settings)
        columns = dict[str, Values]()
        mistakes = Mistakes()
        for name, member in entry.child("zip").mapping():
            with mistakes.noted():
                columns[name] = self._member(self.settings[name], member)
                check_cells(entry, len(columns[name]), len(columns))
        mistakes.check()
        lengths = {name: len(column) for name, column in columns.items()}
        if len(set(lengths.values())) > 1:
            counts = ", ".join(
                f"{name} has {length}" for name, length in lengths.items()
            )
            raise entry.error(f"zip needs parameters of equal length, but {counts}")
        return columns

    def _member(self, setting: Setting, entry: Entry) -> Values:
        """Return the values of a parameter of a zip, with repetitions."""
        if isinstance(entry.value, dict):
            return _grid(setting, _only(entry, GRIDS))
        return _coerced(setting, entry, [child.value for child in entry.entries()])

    def when(self, entry: Entry) -> Expression | None:
        """Return the condition of an axis; None without a condition."""
        if not isinstance(entry.value, dict) or "when" not in entry.value:
            return None
        return read_expression(entry.child("when"), self.settings, CONDITION)


def read_expression(
    entry: Entry, settings: dict[str, Setting], kind: str
) -> Expression:
    """Return the checked expression of an entry.

    Parameters
    ----------
    entry : Entry
    settings : dict
        The parameters that the expression may contain, by name.
    kind : {"a number", "a condition", "a string"}
        Required kind of the value.

    Returns
    -------
    Expression

    Raises
    ------
    SpecError
        If the text is not an expression, or the value has a different kind.
    """
    try:
        expression = parse(entry.text(), settings)
    except ExpressionError as error:
        raise entry.error(f"{entry.name}: {error}") from None
    if expression.kind != kind:
        raise entry.error(
            f'{entry.name} needs {kind}, but "{expression.text}" is {expression.kind}'
        )
    return expression


def _only(entry: Entry, allowed: Iterable[str]) -> Entry:
    """Return the only value of a mapping, which has one of the allowed keys."""
    entry.keys(allowed)
    if len(entry.value) > 1:
        raise entry.error(
            f'"{entry.name}" needs one of {", ".join(entry.value)}, not several'
        )
    return entry.child(next(iter(entry.value)))


def _coerced(setting: Setting, entry: Entry, values: list[object] | Values) -> Values:
    try:
        return setting.column(values)
    except NotAllowedError as error:
        place = (*entry.place, error.index)
        raise entry.document.error(place, str(error)) from None


def _listed(setting: Setting, entry: Entry) -> Values:
    column = _coerced(setting, entry, [child.value for child in entry.entries()])
    distinct, _ = distinct_rows([column])
    if len(distinct) < len(column):
        twice = min(set(range(len(column))) - set(distinct.tolist()))
        raise entry.child(twice).error(
            f'{entry.child(twice).value} is listed twice in "{setting.name}"'
        )
    return column


def _grid(setting: Setting, entry: Entry) -> Values:
    """Return the values of a linspace or logspace, rounded to 12 digits.

    The rounding makes common values of a finer grid and a coarser grid equal.
    """
    limits = entry.entries()
    if len(limits) != 3:
        raise entry.error(
            f'"{entry.name}" must be [first, last, number of values], not a list of'
            f" {len(limits)}"
        )
    first = limits[0].number()
    last = limits[1].number()
    if entry.name == LOGSPACE and min(first, last) <= 0:
        raise entry.error(f"{LOGSPACE} needs numbers above 0")
    with np.errstate(over="ignore", invalid="ignore"):
        values = GRIDS[entry.name](first, last, limits[2].whole(1, MOST_POINTS))
    if not np.isfinite(values).all():
        raise entry.error(f"the limits of {entry.name} are too far apart")
    rounded = (float(f"{value:.{DIGITS}g}") for value in values[1:-1])
    values[1:-1] = np.fromiter(rounded, np.float64, max(len(values) - 2, 0))
    return _coerced(setting, entry, values)


def _check_installed(entry: Entry, sampler: Sampler) -> None:
    needed = sampler.package
    if needed and find_spec(needed.name) is None:
        raise entry.error(
            f"sample: {entry.value} needs the package {needed.name},"
            f" which is not installed: {needed.install}"
        )


def _points(entry: Entry, settings: int) -> int:
    points: int = POINTS.content.read(entry.child("points"))
    check_cells(entry.child("points"), points, settings)
    return points


def _drawn(setting: Setting, entry: Entry, unit: Values) -> Values:
    values = [child.value for child in entry.entries()]
    try:
        return setting.column(DISTRIBUTIONS[entry.name].values(unit, setting, values))
    except NotAllowedError as error:
        raise entry.error(f"{entry.name}: {error}") from None


def distinct_rows(columns: list[Values]) -> tuple[Values, Values]:
    """Return the rows that differ from all earlier rows, and the group of each row.

    Returns
    -------
    distinct : array of int
        Ascending indices of the rows that differ from all earlier rows.
    groups : array of int, shape (rows,)
        For every row, the index in `distinct` of the equal row.
    """
    codes = np.zeros(len(columns[0]), dtype=np.int64)
    for column in columns:
        _, inverse = np.unique(_sortable(column), return_inverse=True)
        _, codes = np.unique(codes * (inverse.max() + 1) + inverse, return_inverse=True)
    _, first, inverse = np.unique(codes, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[inverse]


def _sortable(column: Values) -> Values:
    """Return a column with numbers in place of strings, as numbers sort faster."""
    if column.dtype != np.object_:
        return column
    codes = {text: code for code, text in enumerate(dict.fromkeys(column.tolist()))}
    return np.array([codes[text] for text in column.tolist()])


def _sampler(entry: Entry) -> str | None:
    """Return the sampler of an axis; None for listed points and grids."""
    if not isinstance(entry.value, dict):
        return None
    if "sample" in entry.value:
        return entry.child("sample").text()
    return ALONE if any(form in entry.value for form in DISTRIBUTIONS) else None
