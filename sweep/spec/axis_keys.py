"""Keys of an axis that are equal for all parameters.

An axis has further keys: names of parameters, of grids and of distributions, which have
registries. `sweep.spec.axes` reads an axis and checks the combination of keys.
"""

from sweep.spec.contents import OneOf, ReadLater, Text, Truth, Whole
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.keys import Key
from sweep.spec.limits import MOST_POINTS
from sweep.spec.samplers import SAMPLERS

VALUES = Key(
    ReadLater("a list of distinct values"),
    "the values, in a mapping that may also have `when`",
    name="values",
    otherwise="",
    example="[0.5, 1]",
)
LINSPACE = Key(
    ReadLater("[first, last, number of values]"),
    "values at equal distances",
    name="linspace",
    otherwise="",
    example="[100, 400, 4]",
)
LOGSPACE = Key(
    ReadLater("[first, last, number of values]"),
    "values at equal ratios",
    name="logspace",
    otherwise="",
    example="[0.01, 1, 5]",
)
POINTS = Key(
    Whole(1, MOST_POINTS),
    "number of drawn points, or of blocks of points for saltelli and morris",
    name="points",
    example="500",
)
SAMPLE = Key(
    Text("table, a sampler, or a file that defines a sampler: ./NAME.py"),
    "sampler of several parameters, each a further key with a distribution. table reads"
    " the points from a file",
    name="sample",
    otherwise="",
    example="sobol",
)
FILE = Key(
    Text("the path of a .csv or .parquet file"),
    "for table: file with one row per point",
    name="file",
    example="gains.csv",
)
COLUMNS = Key(
    ReadLater("a list of parameters, or parameters with names of columns"),
    "for table: columns to read",
    name="columns",
    otherwise="all",
    example="{n: boids}",
)
ZIP = Key(
    ReadLater("parameters, each with a list, linspace or logspace"),
    "parameters that vary together, row by row",
    name="zip",
    otherwise="",
    example="{n: [50, 100], steps: [1000, 500]}",
)
ABLATE = Key(
    ReadLater("a preset of the model, or components with parameters and values"),
    "a second preset, or components by name. Each component changes alone, and the last"
    " point has all components. With a preset, each parameter that differs is a"
    " component",
    name="ablate",
    otherwise="",
    example="as_written",
)
LEAVE_OUT = Key(
    Truth(),
    "for ablate: also all components except one, for each component",
    name="leave_out",
    otherwise="false",
    example="true",
)
WHEN = Key(
    Text("a condition"),
    "condition under which the axis applies. At all other points the parameters of the"
    " axis keep the preset values",
    name="when",
    otherwise="everywhere",
    example="n > 50",
)
CONTINUE = Key(
    OneOf("way", ("up", "down", "both")),
    "trials along the axis are links of a chain, one chain per replicate. Each link"
    " starts from the final flock of the previous link. Values ascend (up), descend"
    " (down), or ascend and then descend (both)",
    name="continue",
    otherwise="each trial starts from the initial condition",
    example="both",
)
HOLD = Key(
    Whole(1),
    "for an axis with `continue`: number of steps of each link",
    name="hold",
    otherwise="`steps`",
    example="2000",
)


def axis_keys() -> tuple[Key, ...]:
    """Return all keys of an axis, with the distributions, in the order of the guide."""
    drawn = [
        Key(
            ReadLater("a list"),
            distribution.text,
            name=name,
            otherwise="",
        )
        for name, distribution in DISTRIBUTIONS.items()
    ]
    blocks = [sampler.blocks for sampler in SAMPLERS.values() if sampler.blocks]
    options = [key for rules in blocks for key in rules.options]
    samples = (SAMPLE, *options, FILE, COLUMNS)
    grids = (VALUES, LINSPACE, LOGSPACE)
    chained = (CONTINUE, HOLD)
    return (*grids, *drawn, POINTS, WHEN, *chained, ZIP, *samples, ABLATE, LEAVE_OUT)
