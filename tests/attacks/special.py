"""Pipes, devices, endless files and folders in the place of each file of a study.

Whoever opens one of them waits for ever, or fills the memory. So all of it happens in a
process of its own, which says after each attack what came of it: `python -m
tests.attacks.special FOLDER`.
"""

import json
import os
import resource
import shutil
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import sweep.trial.simulation
from sweep.cli.listing import status_text
from sweep.errors import StoreError
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from tests.studies import SMALL, relaunch

MOST_MEMORY = 8 * 2**30
HUGE = 2**40
LONG = SMALL.replace("steps: 9", "steps: 30") + "checkpoint: 1.0e-9\n"


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def huge(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(HUGE)


def folder(path: Path) -> None:
    path.mkdir()


KINDS = (pipe, device, huge, folder)


def merged(study: Path) -> Path:
    """The one part of a study, merged so that it names what it replaces."""
    store = Store(study)
    return store.merge(store.all_parts(), {})  # type: ignore[return-value]


def part(study: Path) -> Path:
    return next((study / "parts").iterdir())


def listing(name: str) -> Callable[[Path], None]:
    """An attack: the manifest of a part lists that file too."""

    def attack(study: Path) -> None:
        manifest = part(study) / "manifest.json"
        content = json.loads(manifest.read_text())
        content["files"][name] = {"bytes": 4096, "crc32": zlib.crc32(bytes(4096))}
        manifest.write_text(json.dumps(content))

    return attack


FILES: dict[str, Callable[[Path], Path]] = {
    "manifest": lambda study: part(study) / "manifest.json",
    "trials": lambda study: part(study) / "trials.parquet",
    "series": lambda study: part(study) / "series.parquet",
    "unlisted": lambda study: part(study) / "heatmaps.parquet",
    "replaces": lambda study: merged(study) / "replaces.json",
    "plan": lambda study: study / "plan.parquet",
    "spec": lambda study: study / "spec.yaml",
    "asked": lambda study: study / "asked.parquet",
    "lock": lambda study: study / "lock" / "0.json",
}
FOLDERS: dict[str, Callable[[Path], Path]] = {
    "parts/": lambda study: study / "parts",
    "writing/": lambda study: study / "writing",
    "damaged/": lambda study: study / "damaged",
    "lock/": lambda study: study / "lock",
    "checkpoints/": lambda study: study / "checkpoints",
}
LISTED = ("/dev/zero", "../../../../mine", "pipe.parquet", "sub/x.parquet", "..", "")


def launch(results: Path) -> str:
    return str(relaunch(SMALL, results).statuses.total())


def read(results: Path) -> str:
    study = StoredStudy("small", results)
    status_text(study)
    study.store.read_asked()
    return f"{len(study.trials)}, {len(study.series)}"


def outcome(act: Callable[[Path], str], results: Path) -> str:
    try:
        return act(results)
    except StoreError as error:
        return f"StoreError: {error}"


def replacing(
    where: Callable[[Path], Path], kind: Callable[[Path], None]
) -> Callable[[Path], None]:
    """An attack: something else is where a file or folder of a study was."""

    def attack(study: Path) -> None:
        place = where(study)
        place.parent.mkdir(exist_ok=True)
        if place.is_dir():
            shutil.rmtree(place)
        place.unlink(missing_ok=True)
        kind(place)

    return attack


def main(home: Path) -> None:
    """Do all of it below `home`, and print each attack with its outcome, as JSON."""
    relaunch(SMALL, home / "whole")
    sweep.trial.simulation.BOID_STEPS_A_CALL = 60
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))

    def attack(
        name: str, prepare: Callable[[Path], object], act: Callable[[Path], str]
    ) -> None:
        shutil.copytree(home / "whole", home / "results")
        prepare(home / "results" / "small")
        print(
            json.dumps([f"{name} {act.__name__}", outcome(act, home / "results")]),
            flush=True,
        )
        shutil.rmtree(home / "results")

    for act in (launch, read):
        for kind in KINDS:
            for name, place in (FILES | FOLDERS).items():
                attack(f"{name} {kind.__name__}", replacing(place, kind), act)
        for name in LISTED:
            attack(f"listed {name}", listing(name), act)
    checkpoints(home)


def checkpoints(home: Path) -> None:
    """The same with the checkpoints of a study that has no trial stored."""
    trials = (
        Store(home / "long" / "small").trial_ids()
        if relaunch(LONG, home / "long")
        else ()
    )

    def launch_long(results: Path) -> str:
        return str(relaunch(LONG, results).statuses.total())

    for kind in KINDS:
        for ending in ("state", "tried-1", "frames"):
            folder = home / "results" / "small" / "checkpoints"
            folder.mkdir(parents=True)
            for trial in trials:
                kind(folder / f"{trial}.{ending}")
            said = outcome(launch_long, home / "results")
            print(json.dumps([f"{ending} {kind.__name__} launch", said]), flush=True)
            shutil.rmtree(home / "results")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
