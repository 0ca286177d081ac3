"""Derived metrics of a spec, under `derive` of `record`.

An example is `{gain: "polarization / speed"}`. An expression may contain metrics,
parameters and further derived metrics. The value is computed for each frame, from the
metrics of the frame.
"""

import ast
import keyword
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import cast, get_args

from kernels.catalogue import Catalogue
from kernels.metrics import Distribution, Metric
from sweep.spec.axes import read_expression
from sweep.spec.document import Entry
from sweep.spec.evaluation import CONSTANTS, FUNCTIONS, ExpressionError
from sweep.spec.expressions import NUMBER, Expression
from sweep.spec.limits import MOST_DERIVED
from sweep.spec.mistakes import Mistakes
from sweep.spec.recorded import KnownMetrics, names_of_parts
from sweep.spec.schema_parts import Schema, named, reference
from sweep.spec.setting_values import in_order
from sweep.spec.settings import Setting, spelled
from sweep.spec.units import unit_of

NAME = re.compile("[a-z][a-z0-9_]{0,59}")
ENDINGS = ("_mean", "_low", "_high", "_n", "_undefined")
"""Endings of the columns that tables have for a metric."""
TAKEN = (
    *("trial_id", "point", "replicate", "seed", "seed_listed", "streams", "model"),
    *("preset", "every", "status", "error", "replay", "last_step", "seconds"),
    *("frame", "x", "y", "vx", "vy", "boid", "rows", "columns", "visits", "row"),
    *("column", "index", "run", "phase", "candidate", "batch", "block", "scenario"),
    *("detail", "view", "not_done", "event"),
)
"""Further columns of tables."""

SKEWED: Distribution = "skewed"


@dataclass(frozen=True)
class DerivedMetric:
    """A metric that is computed from metrics and parameters, frame by frame.

    Attributes
    ----------
    name : str
    expression : Expression
    unit : str
        Unit in the words of the model.
    distribution : Distribution, default "skewed"
        "count" for a sum of counts, otherwise "skewed". Quotients and products are
        skewed, and the confidence interval of skewed values is also valid for normal
        values.
    """

    name: str
    expression: Expression
    unit: str
    distribution: Distribution = SKEWED


def derived_schema() -> Schema:
    """Return the JSON Schema of expressions by the names of new metrics."""
    names = {"pattern": f"^{NAME.pattern}$", "not": reference("built_in_metric")}
    return named({"type": "string"}, names)


def read_derived(
    entry: Entry | None,
    model: str,
    catalogue: Catalogue,
    settings: Mapping[str, Setting],
) -> tuple[DerivedMetric, ...]:
    """Return the derived metrics of a spec, each after the metrics in its expression.

    Parameters
    ----------
    entry : Entry, optional
        The section of the spec. Without a section there are no derived metrics.
    model : str
        Name of the model.
    catalogue : Catalogue
        Models and metrics by name.
    settings : mapping
        The parameters of the study by name.

    Returns
    -------
    tuple of DerivedMetric

    Raises
    ------
    SpecError
        If a name or an expression is not allowed, or the units do not match.
    """
    if entry is None:
        return ()
    entries = dict(entry.mapping())
    if len(entries) > MOST_DERIVED:
        raise entry.error(
            f"{len(entries):,} derived metrics; at most {MOST_DERIVED} are allowed"
        )
    numbers = {**_measured(model, catalogue), **settings}
    numbers |= {name: _numbers(name) for name in entries}
    expressions = dict[str, Expression]()
    mistakes = Mistakes()
    for name, child in entries.items():
        with mistakes.noted():
            _check_name(child, name, settings, catalogue.metrics)
            expressions[name] = read_expression(child, numbers, NUMBER)
    mistakes.check()
    metrics = KnownMetrics(model, catalogue, tuple(entries))
    derived: list[DerivedMetric] = []
    counts = {
        name
        for name, metric in catalogue.metrics.items()
        if metric.distribution == "count"
    }
    for name, expression in in_order(entry, expressions).items():
        child = entries[name]
        _check_needs(child, expression, metrics)
        try:
            unit = unit_of(expression.tree, numbers)
        except ExpressionError as error:
            raise child.error(f"{name}: {error}") from None
        numbers[name] = replace(numbers[name], unit=unit)
        if _is_sum(expression.tree, counts):
            counts.add(name)
        derived.append(
            DerivedMetric(name, expression, unit, "count" if name in counts else SKEWED)
        )
    return tuple(derived)


def declared(stored: str) -> Distribution:
    """Return the stored distribution of a derived metric; "skewed" for unknown strings.

    Studies of versions up to 0.8 have no stored distribution.
    """
    for distribution in get_args(Distribution):
        if stored == distribution:
            return cast(Distribution, distribution)
    return SKEWED


def _is_sum(tree: ast.expr, names: Collection[str]) -> bool:
    """Return whether an expression is a sum of some of the names."""
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Add):
        return _is_sum(tree.left, names) and _is_sum(tree.right, names)
    return isinstance(tree, ast.Name) and tree.id in names


def needed(derived: Iterable[DerivedMetric]) -> list[str]:
    """Return the distinct names in the expressions of metrics."""
    names = dict.fromkeys(
        name for metric in derived for name in sorted(metric.expression.names)
    )
    return list(names)


def _measured(name: str, catalogue: Catalogue) -> dict[str, Setting]:
    model = catalogue.models[name]
    metrics = (*catalogue.metrics, *names_of_parts(model, catalogue))
    return {
        metric: _numbers(metric, spelled(catalogue.metrics[metric].unit, model))
        for metric in metrics
    }


def _numbers(name: str, unit: str = "") -> Setting:
    """Return a metric in the form that expressions need: a number with a unit."""
    return Setting(name, "float", "metrics", text="", unit=unit)


def _check_name(
    entry: Entry,
    name: str,
    settings: Mapping[str, Setting],
    metrics: Mapping[str, Metric],
) -> None:
    def refused(why: str) -> None:
        raise entry.error(f'derived metric "{name}" is not allowed: {why}')

    if not NAME.fullmatch(name) or name.endswith(ENDINGS):
        refused(
            "a name has lower-case letters, digits and _, begins with a letter, and"
            f" does not end in {', '.join(ENDINGS)}"
        )
    for kind, names in (
        ("metric", metrics),
        ("parameter", settings),
        ("column of the tables", TAKEN),
        ("word of expressions", {*CONSTANTS, *FUNCTIONS, *keyword.kwlist}),
    ):
        if name in names:
            refused(f"a {kind} already has this name")


def _check_needs(entry: Entry, expression: Expression, metrics: KnownMetrics) -> None:
    names = sorted(expression.names)
    for name in names:
        metrics.check(entry, name)
    if not any(
        name in metrics.catalogue.metrics or name in metrics.derived for name in names
    ):
        raise entry.error(
            f'{entry.name}: "{expression.text}" contains no metric (`sweep metrics`);'
            ' write an expression of parameters under "derive" of the spec'
        )
