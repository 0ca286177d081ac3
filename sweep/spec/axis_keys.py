"""The keys of an axis that are the same for all settings.

An axis has other keys too: names of settings, of grids and of distributions, which have
registries of their own. So what may stand beside what is checked by the code that reads
an axis, in `sweep.spec.axes`. Here is what each of the fixed keys means.
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
    """All of these, and the distributions, in the order of the guide."""
    drawn = [
        Key(
            ReadLater("a list"),
            about.text,
            name=name,
            otherwise="",
        )
        for name, about in DISTRIBUTIONS.items()
    ]
    rules = [about.blocks for about in SAMPLERS.values() if about.blocks]
    own = [key for one in rules for key in one.options]
    samples = (SAMPLE, *own, FILE, COLUMNS)
    grids, chained = (VALUES, LINSPACE, LOGSPACE), (CONTINUE, HOLD)
    return (*grids, *drawn, POINTS, WHEN, *chained, ZIP, *samples, ABLATE, LEAVE_OUT)
