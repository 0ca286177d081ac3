"""boidsweep: Monte Carlo experiments and parameter sweeps over boid swarms.

A study flows down this list, and each package imports only what stands above it:

    errors       every error that a user can mend
    text         words for people
    surroundings what lies in the current folder neither runs nor counts as settings
    method       what a method is, and which there are
    analysis/    arrays and tables -> estimates with intervals
    spec/        YAML -> Study, and its schema
    own_code/    models and more from files beside a spec
    design/      Study -> points -> jobs, and what they cost
    trial/       a job -> a Result: the one door to the kernels
    store/       parts, whole or absent; locks; origin
    workers/     jobs in processes, here or on a cluster; limits; checkpoints
    testing/     whether a model keeps the promises of the built-in ones
    tables/      what is stored: chosen, reported, exported
    campaigns/   which trials run: a fixed number, until an interval is narrow, a search
    figures/     tables -> pictures
    methods/     what may be asked of results: comparison, power, scaling and more
    loaded       a stored study, as notebooks and programs have it
    replays/     a stored trial again: bits, frames, film
    published/   claims, verdicts, scorecard
    sharing/     a study for others: one file, citation, description
    web/         the live simulator, as a page and as a widget
    explorer/    results as pages: to explore, and as one file for readers
    cli/         the commands and what they print
"""

import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep import errors
from sweep.text import harmless, make_harmless, so_many
from sweep.trial.compiled import OurKernels, check_kernels

if TYPE_CHECKING:
    from sweep.campaigns.search.plan import SearchPlan
    from sweep.design.plan import Plan
    from sweep.explorer.widget import Explored
    from sweep.loaded import LoadedStudy
    from sweep.methods.comparison import Comparison, Inference
    from sweep.sharing.citing import Citation
    from sweep.spec.recorded import Over
    from sweep.spec.settings import Value
    from sweep.spec.study import Study
    from sweep.store.locations import Location
    from sweep.tables.stored_study import StoredStudy
    from sweep.web.widget import View

__all__ = [
    "__version__",
    "cite",
    "compare",
    "errors",
    "load",
    "odd",
    "pack",
    "plan",
    "replay",
    "run",
    "show",
    "unpack",
    "view",
]
__version__ = "0.18.0"


check_kernels(sys.modules.get("kernels"))
sys.meta_path.insert(0, OurKernels())
logging.getLogger(__name__).addFilter(make_harmless)


def load(
    study: str, results: "str | Location" = "results", *, trust: bool = False
) -> "LoadedStudy":
    """The stored results of `study`, e.g. `load("nguyen2024/separation").trials`.

    `results` is a folder, or `s3://bucket/prefix`. Code of its own that somebody else
    has launched runs only with `trust`, where a trial is run again: tables need none.
    Raises StoreError where nothing of it is stored there.
    """
    from sweep.loaded import LoadedStudy

    return LoadedStudy(study, results, trust=trust)


def run(
    spec: str | Path | Mapping[str, Any],
    results: "str | Location" = "results",
    workers: int = 0,
    *,
    code_from: str | Path | None = None,
) -> "LoadedStudy":
    """Run what is missing of a study, as `sweep launch` and `sweep search` do, and
    return what is stored of it; of the variants that `validate` asks for, too.

    `spec` is the path of a file, or the spec itself: a YAML text of several lines, or a
    mapping. It runs in `workers` processes, as many as there are cores for 0. Files of
    code that it names lie beside it, or in `code_from` and below. Nothing is printed;
    trials that did not come to their end are a warning. Raises SpecError for what is
    wrong with the spec, StoreError where `results` cannot be read or written,
    ValueError for a negative number of workers, FailedTrialsError where more trials
    have failed than the spec allows, and KeyboardInterrupt, both with all finished
    trials stored: after the latter the same call goes on.
    """
    import warnings

    from sweep.campaigns.launch import launch, search
    from sweep.own_code.reading import with_variants
    from sweep.store.locations import location
    from sweep.workers.executors import Loky, worker_count

    if workers < 0:
        raise ValueError(
            f"workers: {workers}; allowed: 0, as many as there are cores, or more"
        )
    study = _study(spec, code_from)
    studies = with_variants(study)
    engine = Loky(worker_count(workers))
    try:
        for one in studies:
            (search if one.search else launch)(one, location(results), engine)
    finally:
        engine.stop()
    stored = load(study.name, results)
    troubled = {
        status: count for status, count in stored.statuses().items() if status != "done"
    }
    if troubled:
        counts = ", ".join(
            f"{count:,} {status}" for status, count in sorted(troubled.items())
        )
        trials = so_many(stored.plan.num_rows, "trial")
        about = f"study {study.name}: {counts}, of {trials}"
        warnings.warn(harmless(about), stacklevel=2)
    return stored


def plan(
    spec: str | Path | Mapping[str, Any],
    workers: int = 0,
    *,
    results: "str | Location" = "results",
    code_from: str | Path | None = None,
) -> "Plan | SearchPlan":
    """What `run` would do with the same arguments, without running it.

    `plan("spec.yaml").trials` is a number; `print(plan("spec.yaml").as_text())` is what
    `sweep plan` says: points, trials, and estimates of seconds and bytes. Of code that
    is none of ours a few short trials are run, to measure it. Where last states are
    recorded, those below `results` are looked for. Raises SpecError for what is wrong
    with the spec, and where none of these trials can run; StoreError where results that
    are there cannot be read.
    """
    from sweep.campaigns.plan import plan_of
    from sweep.store.locations import location
    from sweep.workers.executors import worker_count

    study = _study(spec, code_from)
    return plan_of(study, worker_count(workers), location(results))


def compare(
    one: str,
    other: str,
    metrics: str | Sequence[str] = (),
    *,
    results: "str | Location" = "results",
    over: "Over" = "last",
    method: "Inference | None" = None,
    half: bool = False,
) -> "Comparison":
    """What `other` has more or less than `one`, as `sweep compare` says it.

    Both are `STUDY`, `STUDY:setting=value` or `STUDY:PRESET`. `metrics` are all where
    none is named, `over="half"` takes means over the last half of a trial (as its older
    form `half=True`), and `method` says how the rows are tested together. The table is
    `.rows` of the result: a row a point and metric, with difference, interval, p and
    verdict. Raises ChoiceError for what cannot be compared, and StoreError where
    nothing is stored.
    """
    from sweep.methods.comparison import compare_sides, read_side
    from sweep.spec.recorded import is_half
    from sweep.store.locations import location

    place = location(results)
    first, second = read_side(one, place), read_side(other, place)
    half = is_half(over, half)
    return compare_sides(first, second, metrics, half=half, method=method)


def view(
    model: str | None = None,
    preset: str | None = None,
    seed: int = 1,
    **settings: "Value",
) -> "View":
    """The live simulator as a widget of a notebook, e.g.
    `sweep.view(model="nguyen2024", n=300)`.

    Without a model it shows the first that there is, without a preset `as_run`. A model
    of one's own is named by its file, `./vortex.py` or `./file.py:NAME`, which runs.
    `settings` are those of the model, and `map`; the others have the values of the
    preset. Without a front end it shows the picture of its first frame. Raises
    SpecError for what a spec would not accept, and ImportError without anywidget.
    """
    from kernels.catalogue import BUILT_IN
    from sweep.own_code.reading import named_model
    from sweep.web.widget import live

    name, known = named_model(model) if model else (None, BUILT_IN)
    return live(name, preset, seed, settings, known)


def replay(study: "LoadedStudy", trial: str) -> "View":
    """A stored trial run again, as a widget of a notebook in which it is played and
    scrubbed through.

    `study` is what `load` returns. Raises ChoiceError where it has no such trial,
    StoreError where the trial cannot be run again, and ImportError without anywidget.
    """
    from sweep.web.widget import replay

    return replay(study, trial)


def show(
    study: "StoredStudy | str | None" = None, results: "str | Location" = "results"
) -> "Explored":
    """The results explorer as a widget of a notebook: figures, tables, and the trials
    behind each number, which play, as `sweep show` has them.

    `study` is what `load` returns, or a name below `results`; without one it begins
    with the list of all studies there. It reads again what a launch stores meanwhile.
    Without a front end it shows the first figure of the study. Raises StoreError where
    nothing is stored, ChoiceError for what is no name of a study and for one that
    `where` has restricted, and ImportError without anywidget.
    """
    from sweep.explorer.widget import explored, explored_study
    from sweep.store.locations import location

    if study is None or isinstance(study, str):
        return explored(location(results), study, trust=False)
    return explored_study(study)


def pack(
    study: "StoredStudy | str",
    path: str | Path | None = None,
    results: "str | Location" = "results",
    *,
    force: bool = False,
) -> Path:
    """Write a stored study into one .zip file, as `sweep pack` does; the file's path.

    `study` is what `load` returns, or a name below `results`. Raises StoreError where
    it cannot be read, ChoiceError where it has no trials, and OutputError for a file
    that is there already without `force`.
    """
    from sweep.sharing.packing import pack

    to = None if path is None else Path(path)
    return pack(_stored(study, results), to, force=force).path


def unpack(
    path: str | Path,
    name: str | None = None,
    results: "str | Location" = "results",
    *,
    to: str | Path | None = None,
) -> "LoadedStudy":
    """Store the study of a file that `pack` has written below `results`, as `name` or
    as it was called, and load it, as `sweep load` does. No code of it runs.

    `to` is a new folder that gets its spec and its code, to launch it on. Raises
    StoreError for a file that is damaged or none of these, and where there is such a
    study, ChoiceError for what is no name of a study, and OutputError for a folder `to`
    that exists.
    """
    from sweep.sharing.laid_out import check_new, lay_out
    from sweep.sharing.unpacking import unpack
    from sweep.store.locations import location

    if to is not None:
        check_new(Path(to))
    stored = load(unpack(Path(path), location(results), name).study, results)
    if to is not None:
        lay_out(stored, Path(to))
    return stored


def cite(
    study: "StoredStudy | str | None" = None, results: "str | Location" = "results"
) -> "Citation":
    """What to cite with a study, or for the program alone.

    `study` is what `load` returns, or a name below `results`. The result has `works`,
    and is printed by `as_text()`, `as_bibtex()` and `as_json()`. Raises StoreError
    where the study cannot be read, and ChoiceError where it has no trials.
    """
    from sweep.sharing.citing import cite

    return cite(None if study is None else _stored(study, results))


def odd(
    study: "StoredStudy | str | Path | Mapping[str, Any]",
    results: "str | Location" = "results",
    *,
    code_from: str | Path | None = None,
) -> str:
    """An ODD description of a model and a study in Markdown, as `sweep odd` prints it.

    `study` is what `load` returns, a name below `results`, or a spec as `run` takes it;
    the path of one, as a text, ends in .yaml or .yml. Raises StoreError where a study
    cannot be read, ChoiceError where it has no trials, and SpecError for what is wrong
    with a spec.
    """
    from sweep.design.design import expand
    from sweep.sharing.odd import odd, of_spec, of_stored
    from sweep.spec.study_folder import SPEC_ENDINGS
    from sweep.tables.stored_study import StoredStudy

    if isinstance(study, str) and "\n" not in study:
        is_path = study.endswith(SPEC_ENDINGS)
        study = Path(study) if is_path else load(study, results)
    if isinstance(study, StoredStudy):
        return odd(of_stored(study))
    spec = _study(study, code_from)
    return odd(of_spec(spec, expand(spec)))


def _stored(study: "StoredStudy | str", results: "str | Location") -> "StoredStudy":
    """The study itself, or that of a name."""
    return load(study, results) if isinstance(study, str) else study


def _study(
    spec: str | Path | Mapping[str, Any], code_from: str | Path | None
) -> "Study":
    """The study of a file, of a YAML text of several lines, or of a mapping."""
    from sweep.own_code.reading import load_spec, study_of

    folder = Path(code_from) if code_from is not None else None
    if isinstance(spec, Mapping) or (isinstance(spec, str) and "\n" in spec):
        return study_of(spec, code_from=folder)
    return load_spec(Path(spec), code_from=folder)
