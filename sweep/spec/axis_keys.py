"""Keys of an axis that are the same for all parameters.

An axis has further keys: names of parameters, of grids and of distributions, which have
registries. `sweep.spec.axes` reads an axis and checks which keys go together.
"""

from sweep.spec.contents import OneOf, ReadLater, Text, Truth, Whole
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.keys import Key
from sweep.spec.limits import MOST_POINTS
from sweep.spec.samplers import SAMPLERS

VALUES = Key(
    ReadLater("a list, none twice"),
    "the values, as in a list without a mapping",
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
    "number of points where they are drawn; of blocks of them for saltelli and morris",
    name="points",
    example="500",
)
SAMPLE = Key(
    Text("table, a sampler, or a file that has one: ./NAME.py"),
    "what draws the points of several settings, each of which stands beside it with its"
    " distribution; table reads them from a file",
    name="sample",
    otherwise="",
    example="sobol",
)
FILE = Key(
    Text("the path of a .csv or .parquet file"),
    "of table: where the points stand, a row each",
    name="file",
    example="gains.csv",
)
COLUMNS = Key(
    ReadLater("a list of settings, or settings with names of columns"),
    "of table: the columns to read",
    name="columns",
    otherwise="all",
    example="{n: boids}",
)
ZIP = Key(
    ReadLater("settings, each with a list, linspace or logspace"),
    "settings that vary together, row by row",
    name="zip",
    otherwise="",
    example="{n: [50, 100], steps: [1000, 500]}",
)
ABLATE = Key(
    ReadLater("a preset of the model, or details, each with settings and values"),
    "another preset, or details by name: each setting in which the preset differs, or"
    " each detail, is changed alone, and last all of them",
    name="ablate",
    otherwise="",
    example="as_written",
)
LEAVE_OUT = Key(
    Truth(),
    "of ablate: also all details but one, for each",
    name="leave_out",
    otherwise="false",
    example="true",
)
WHEN = Key(
    Text("a condition"),
    "condition under which the axis applies; elsewhere its settings are not varied",
    name="when",
    otherwise="everywhere",
    example="n > 50",
)
CONTINUE = Key(
    OneOf("way", ("up", "down", "both")),
    "trials along the axis are links of chains: each begins where the one before it has"
    " ended. up: from the least value to the greatest; down: the other way; both: up,"
    " then down from the top. A chain for each replicate",
    name="continue",
    otherwise="each trial begins anew",
    example="both",
)
HOLD = Key(
    Whole(1),
    "of an axis with `continue`: how many steps each link takes",
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
