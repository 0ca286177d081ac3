"""Files with tracked individuals, and studies of them."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sweep.design import Job, Jobs, expand
from sweep.own_code import study_of
from sweep.spec import Study

Row = tuple[object, ...]


def written(
    folder: Path,
    rows: Iterable[Row],
    header: str = "id,t,x,y",
    name: str = "tracks.csv",
) -> Path:
    """A CSV file."""
    file = folder / name
    lines = [header, *(",".join(map(str, row)) for row in rows)]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def study_of_tracks(
    folder: Path,
    recording: Mapping[str, Any] | None = None,
    **keys: Any,
) -> Study:
    """The study of the files of a folder, with frames of a tenth of a second."""
    section = {"files": ["*.csv"], "time_step": 0.1, **(recording or {})}
    spec = {"study": "lab/tracks", "recording": section, **keys}
    return study_of(spec, folder / "spec.yaml")


def jobs_of(study: Study) -> list[Job]:
    jobs = Jobs(study, expand(study))
    return [jobs.at(place) for place in range(len(jobs))]
