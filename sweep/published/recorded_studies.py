"""A custom study, begun from a file of tracked individuals."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sweep.published.starting import OWN, Begun, check_new_spec, for_editors
from sweep.recordings import Survey, survey
from sweep.spec import ANY, RecordingSpec, dump, keys_of
from sweep.tables import unfinished
from sweep.text import so_many

HEAD = """\

# A study of the recording {file}. The first {rows} have {individuals}, within
# {width:.4g} by {height:.4g} in the unit of the file. Check the values that the file
# cannot tell: the unit of length and the ranges of metrics. Then run
# `sweep launch {spec}`. `sweep guide recordings` explains all keys.
"""
FRAMES_ONLY = "the file has numbers of frames: write the time between two frames"
REGULAR = "mean time between two rows of an individual without gaps"
GAPS = (
    "longest time between two rows that is interpolated; the longest in the first rows"
    " is {longest:g} s"
)


def begin_with_recording(
    recording: Path, path: Path | None = None, *, force: bool = False
) -> Begun:
    """Write the spec of a study of a recording, with facts from its first rows.

    Parameters
    ----------
    recording : Path
        CSV or parquet file, in the folder of the spec or below.
    path : Path, optional
        File of the new spec; by default the name of the recording.
    force : bool, default False
        Allow to replace an existing file.

    Returns
    -------
    Begun

    Raises
    ------
    SpecError
        If the file cannot be read, or lacks a column with a usual name.
    OutputError
        If the spec cannot be written.
    """
    target = path or recording.with_suffix(".yaml")
    check_new_spec(target, force=force)
    facts = survey(recording)
    name = f"{OWN}/{target.stem}"
    file = Path(os.path.relpath(recording, target.parent)).as_posix()
    text = "".join(_lines(name, file, target, facts))
    with unfinished(target) as out:
        out.write(for_editors(text).encode())
    return Begun(name, "launch", target, (target,))


def _lines(name: str, file: str, target: Path, facts: Survey) -> Iterator[str]:
    yield HEAD.format(
        file=file,
        rows=so_many(facts.rows, "row"),
        individuals=so_many(facts.individuals, "individual"),
        width=facts.width,
        height=facts.height,
        spec=target.name,
    )
    yield f"{_line('study', name)}\nrecording:\n"
    meanings = {key.name: key.text for key in keys_of(RecordingSpec)}
    meanings["time_step"] += f": {REGULAR}"
    meanings["gaps"] = GAPS.format(longest=facts.longest)
    if facts.time_step is None:
        yield f"  # time_step: {FRAMES_ONLY}\n"
    for key, value in _section(file, facts).items():
        yield f"  # {meanings[key]}\n  {_line(key, value)}\n"
    yield "# ranges of metrics, in the unit of length\n"
    yield f"{_line('fixed', {'flock_range': 1, 'contact_distance': 0.1})}\n"


def _section(file: str, facts: Survey) -> dict[str, Any]:
    """Return the section `recording` of a spec."""
    columns = dict(facts.columns)
    if ANY in columns["x"]:
        del columns["individual"]
    velocities = {"velocities": "given"} if "vx" in facts.columns else {}
    delimiter = {"delimiter": facts.delimiter} if facts.delimiter != "comma" else {}
    return {
        "files": [file],
        "columns": columns,
        **delimiter,
        **({"time_step": _plain(facts.time_step)} if facts.time_step else {}),
        **({"coordinates": "degrees"} if facts.in_degrees else {}),
        "length": facts.length or RecordingSpec.length,
        "scale": 1,
        "gaps": 0 if facts.is_regular else 2 * (facts.time_step or 0.0),
        **velocities,
    }


def _plain(number: float) -> float:
    """Return a number without a fraction as an integer."""
    return int(number) if number == int(number) else number


def _line(key: str, value: Any) -> str:
    """Return a key with its value in one line of YAML."""
    if isinstance(value, dict):
        members = ", ".join(_line(name, member) for name, member in value.items())
        return f"{key}: {{{members}}}"
    return dump({key: value}).strip().removeprefix("{").removesuffix("}")
