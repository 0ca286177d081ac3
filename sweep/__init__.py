"""boidsweep: Monte Carlo experiments and parameter sweeps over boid swarms.

The list has the order of the layers. Each package imports only entries above it.

    errors       every error that a user can fix
    text         words for people
    surroundings files of the current folder neither run nor count as settings

    method       the entry of a method, and the registry of methods
    analysis/    arrays and tables -> estimates with confidence intervals
    spec/        YAML -> Study, and its schema
    recordings/  tracked individuals -> frames

    own_code/    models and more from files next to a spec
    design/      Study -> points -> jobs, and their cost
    trial/       a job -> a Result: the only access to the kernels

    store/       parts, complete or absent; locks; origin
    workers/     jobs in processes, here or on a cluster; limits; checkpoints
    testing/     checks of a model: the requirements that built-in models meet

    tables/      stored trials: selected, reported, exported
    campaigns/   the trials to run: all trials of a design, or requests of a method
    figures/     tables -> figures

    methods/     analyses of results: comparison, power, scaling and more
    loaded       a stored study for notebooks and programs
    replays/     a stored trial again: comparison, frames, animation

    published/   claims, verdicts, scorecard
    sharing/     a study for other people: one file, citation, description
    web/         the live simulator, as a page and as a widget

    explorer/    results as pages: to explore, and as one file for readers
    cli/         the commands and their output
"""

import logging
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweep import errors
from sweep.text import harmless, make_harmless, so_many
from sweep.trial import OurKernels, check_kernels

if TYPE_CHECKING:
    from sweep.design import StudyPlan
    from sweep.explorer import Explored
    from sweep.loaded import LoadedStudy
    from sweep.methods.comparison import Comparison, Inference
    from sweep.sharing import Citation
    from sweep.spec import Over, Study, Value
    from sweep.store import Location
    from sweep.tables import StoredStudy
    from sweep.web import View

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
    """Load a stored study.

    Parameters
    ----------
    study : str
        The name of the study, such as "nguyen2024/separation".
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    trust : bool, default False
        Allow custom code of a study that somebody else launched. Only running a trial
        again needs it; tables and figures run no code.

    Returns
    -------
    LoadedStudy
        Each table is read at its first use: `trials`, `series`, `heatmaps` and
        `trajectories`.

    Raises
    ------
    StoreError
        The study is not stored in `results`.
    ChoiceError
        `study` is not a name of a study.

    Examples
    --------
    >>> sweep.load("my/first")
    <StoredStudy my/first: 30 trials>
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
    """Run all missing trials of a study and return its stored results.

    The function is equivalent to `sweep launch`, without printed output. The variants
    that `validate` requests run too. After an interruption a repeated call resumes,
    because finished trials are stored.

    Parameters
    ----------
    spec : str, Path or mapping
        The path of a spec, its YAML text (more than one line), or a mapping.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    workers : int, default 0
        The number of worker processes; 0 for one per core.
    code_from : str or Path, optional
        The folder that is searched for custom code, with the folders below it; by
        default custom code is next to the spec.

    Returns
    -------
    LoadedStudy
        The stored results.

    Warns
    -----
    UserWarning
        Trials diverged, failed, timed out or are missing.

    Raises
    ------
    SpecError
        The spec is not valid.
    StoreError
        `results` cannot be read or written.
    ValueError
        `workers` is negative.
    FailedTrialsError
        More trials failed than the spec allows. Finished trials are stored.

    Examples
    --------
    >>> study = sweep.run("spec.yaml", workers=4)
    >>> study
    <StoredStudy my/first: 30 trials>
    >>> study.table("polarization")[["separation_weight", "polarization"]].round(2)
       separation_weight  polarization
    0                0.5          0.57
    1                1.0          0.30
    2                2.0          0.58
    """
    import warnings

    from sweep.campaigns import launch
    from sweep.own_code import with_variants
    from sweep.store import location
    from sweep.workers import Loky, worker_count

    if workers < 0:
        raise ValueError(
            f"workers: {workers}; allowed: 0 for one per core, or a number above 0"
        )
    study = _study(spec, code_from)
    studies = with_variants(study)
    engine = Loky(worker_count(workers))
    try:
        for variant in studies:
            launch(variant, location(results), engine)
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
        message = f"study {study.name}: {counts}, of {trials}"
        warnings.warn(harmless(message), stacklevel=2)
    return stored


def plan(
    spec: str | Path | Mapping[str, Any],
    workers: int = 0,
    *,
    results: "str | Location" = "results",
    code_from: str | Path | None = None,
) -> "StudyPlan":
    """Estimate the trials, time and storage of a study before any trial runs.

    Custom code runs in a few short trials, which measure the speed of the code.

    Parameters
    ----------
    spec : str, Path or mapping
        The path of a spec, its YAML text (more than one line), or a mapping.
    workers : int, default 0
        The number of worker processes; 0 for one per core.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix". A study that records last
        states resumes from trials that are stored here.
    code_from : str or Path, optional
        The folder that is searched for custom code, with the folders below it; by
        default custom code is next to the spec.

    Returns
    -------
    StudyPlan
        Numbers of points and trials, and estimates in seconds and bytes. `as_text()` is
        the output of `sweep plan`.

    Raises
    ------
    SpecError
        The spec is not valid, or none of the measured trials can run.
    StoreError
        Stored results cannot be read.

    Examples
    --------
    >>> sweep.plan("spec.yaml").trials
    30
    """
    from sweep.campaigns import plan_of
    from sweep.store import location
    from sweep.workers import worker_count

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
    """Compare two studies, or two groups of points, metric by metric.

    Parameters
    ----------
    one, other : str
        The two sides, each "STUDY", "STUDY:setting=value" or "STUDY:PRESET".
        Differences are other - one.
    metrics : str or sequence of str, optional
        By default all metrics that both sides recorded.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    over : {"last", "half"}, default "last"
        Compare the last frames, or means over the second half of each trial.
    method : Inference, optional
        The confidence level, the correction for multiple comparisons, and the
        equivalence margin.
    half : bool, default False
        The older form of `over="half"`.

    Returns
    -------
    Comparison
        `rows` has one row per point and metric, with the difference, its simultaneous
        confidence interval, the adjusted p-value and the verdict.

    Raises
    ------
    ChoiceError
        The sides cannot be compared, or `over` is neither of its values.
    StoreError
        A study is not stored.

    Examples
    --------
    >>> sides = "my/first:separation_weight=1", "my/first:separation_weight=2"
    >>> found = sweep.compare(*sides, "polarization")
    >>> found.rows[["metric", "difference", "low", "high", "verdict"]].round(2)
             metric  difference   low  high verdict
    0  polarization        0.28  0.11  0.45  higher
    """
    from sweep.methods.comparison import compare_sides, read_side
    from sweep.spec import is_half
    from sweep.store import location

    place = location(results)
    control = read_side(one, place)
    treated = read_side(other, place)
    half = is_half(over, half)
    return compare_sides(control, treated, metrics, half=half, method=method)


def view(
    model: str | None = None,
    preset: str | None = None,
    seed: int = 1,
    **settings: "Value",
) -> "View":
    """Show the live simulator as a widget of a notebook.

    Without a front end the widget shows a figure of its first frame.

    Parameters
    ----------
    model : str, optional
        The name of a model, or the file of a custom model, which runs: "./vortex.py" or
        "./file.py:NAME". By default the first built-in model.
    preset : str, optional
        A preset of the model; by default "as_run", or its first preset.
    seed : int, default 1
        The seed of the run.
    **settings
        Parameters of the model, in their units, and `map`. The preset has the values of
        all other parameters.

    Returns
    -------
    View
        The widget.

    Raises
    ------
    SpecError
        A spec would not accept an argument.
    ImportError
        anywidget is not installed.

    Examples
    --------
    >>> sweep.view(model="nguyen2024", n=300)
    """
    from kernels.catalogue import BUILT_IN
    from sweep.own_code import named_model
    from sweep.web import live

    name, catalogue = named_model(model) if model else (None, BUILT_IN)
    return live(name, preset, seed, settings, catalogue=catalogue)


def replay(study: "LoadedStudy", trial: str) -> "View":
    """Run a stored trial again and play the trial in a widget of a notebook.

    Parameters
    ----------
    study : LoadedStudy
        The study that `load` returns.
    trial : str
        The id of the trial, or its beginning.

    Returns
    -------
    View
        The widget.

    Raises
    ------
    ChoiceError
        The study has no such trial.
    StoreError
        The trial cannot run again.
    ImportError
        anywidget is not installed.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> view = sweep.replay(study, study.trials["trial_id"][0])
    >>> type(view).__name__
    'View'
    """
    from sweep.web import replay

    return replay(study, trial)


def show(
    study: "StoredStudy | str | None" = None, results: "str | Location" = "results"
) -> "Explored":
    """Show the results explorer as a widget of a notebook.

    The widget has the explorer of `sweep show`: figures, tables, and the trials behind
    each number, which can be played. The explorer also shows trials that a launch
    stores later. Without a front end the widget shows the first figure of the study.

    Parameters
    ----------
    study : StoredStudy or str, optional
        The study that `load` returns, or a name in `results`; by default the list of
        all studies.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".

    Returns
    -------
    Explored
        The widget.

    Raises
    ------
    StoreError
        The study is not stored.
    ChoiceError
        `study` is not a name of a study, or `where` has restricted it.
    ImportError
        anywidget is not installed.

    Examples
    --------
    >>> sweep.show("my/first")
    """
    from sweep.explorer import explored, explored_study
    from sweep.store import location

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
    """Write a stored study to one .zip file, like `sweep pack`.

    Parameters
    ----------
    study : StoredStudy or str
        The study that `load` returns, or a name in `results`.
    path : str or Path, optional
        The new file; by default in the current folder, named after the study.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    force : bool, default False
        Replace a file that exists.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    StoreError
        The study cannot be read.
    ChoiceError
        The study has no trials, or `where` has restricted it.
    OutputError
        The file exists without `force`, or cannot be written.

    Examples
    --------
    >>> sweep.pack("my/first", "first.zip")
    PosixPath('first.zip')
    """
    from sweep.sharing import pack

    to = None if path is None else Path(path)
    return pack(_stored(study, results), to, force=force).path


def unpack(
    path: str | Path,
    name: str | None = None,
    results: "str | Location" = "results",
    *,
    to: str | Path | None = None,
) -> "LoadedStudy":
    """Store the study of a packed file and load the study, like `sweep load`.

    No code of the study runs.

    Parameters
    ----------
    path : str or Path
        A file that `pack` has written.
    name : str, optional
        The name of the stored study; by default the name that was packed.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    to : str or Path, optional
        A new folder for the spec and the code, from which the study can be launched.

    Returns
    -------
    LoadedStudy
        The stored study.

    Raises
    ------
    StoreError
        The file is damaged or is not a packed study, or such a study is stored already.
    ChoiceError
        `name` is not a name of a study.
    OutputError
        The folder `to` exists.

    Examples
    --------
    >>> sweep.unpack("first.zip", "their/first")
    <StoredStudy their/first: 30 trials>
    """
    from sweep.sharing import check_new, lay_out, unpack
    from sweep.store import location

    if to is not None:
        check_new(Path(to))
    stored = load(unpack(Path(path), location(results), name).study, results)
    if to is not None:
        lay_out(stored, Path(to))
    return stored


def cite(
    study: "StoredStudy | str | None" = None, results: "str | Location" = "results"
) -> "Citation":
    """Return the works to cite with a study, or with the program alone.

    Parameters
    ----------
    study : StoredStudy or str, optional
        The study that `load` returns, or a name in `results`; by default the program.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".

    Returns
    -------
    Citation
        The `works`, with `as_text()`, `as_bibtex()` and `as_json()`.

    Raises
    ------
    StoreError
        The study cannot be read.
    ChoiceError
        The study has no trials.

    Examples
    --------
    >>> print(sweep.cite("my/first").as_bibtex())
    @misc{boidsweep,
      title = {{boidsweep: Monte Carlo experiments and parameter sweeps ...}},
      ...
    }
    ...
    @misc{my-first,
      title = {{Study my/first: 30 trials of the model nguyen2024}},
      ...
    }
    """
    from sweep.sharing import cite

    return cite(None if study is None else _stored(study, results))


def odd(
    study: "StoredStudy | str | Path | Mapping[str, Any]",
    results: "str | Location" = "results",
    *,
    code_from: str | Path | None = None,
) -> str:
    """Return an ODD description of a model and a study, like `sweep odd`.

    Parameters
    ----------
    study : StoredStudy, str, Path or mapping
        The study that `load` returns, a name in `results`, or a spec as `run` takes it.
        A path that is a string ends in .yaml or .yml.
    results : str or Location, default "results"
        The folder of stored studies, or "s3://bucket/prefix".
    code_from : str or Path, optional
        The folder that is searched for custom code of a spec, with the folders below
        it; by default custom code is next to the spec.

    Returns
    -------
    str
        The description in Markdown.

    Raises
    ------
    StoreError
        The study cannot be read.
    ChoiceError
        The study has no trials.
    SpecError
        The spec is not valid.

    Examples
    --------
    >>> print(sweep.odd("spec.yaml"))
    # ODD of the study my/first
    ...
    ## 1. Purpose and patterns
    ...
    """
    from sweep.design import expand
    from sweep.sharing import odd, of_spec, of_stored
    from sweep.spec import SPEC_ENDINGS
    from sweep.tables import StoredStudy

    if isinstance(study, str) and "\n" not in study:
        is_path = study.endswith(SPEC_ENDINGS)
        study = Path(study) if is_path else load(study, results)
    if isinstance(study, StoredStudy):
        return odd(of_stored(study))
    spec = _study(study, code_from)
    return odd(of_spec(spec, expand(spec)))


def _stored(study: "StoredStudy | str", results: "str | Location") -> "StoredStudy":
    """Return the study itself, or load the study of a name."""
    return load(study, results) if isinstance(study, str) else study


def _study(
    spec: str | Path | Mapping[str, Any], code_from: str | Path | None
) -> "Study":
    """Read the study of a file, of a YAML text of several lines, or of a mapping."""
    from sweep.own_code import load_spec, study_of

    folder = Path(code_from) if code_from is not None else None
    if isinstance(spec, Mapping) or (isinstance(spec, str) and "\n" in spec):
        return study_of(spec, code_from=folder)
    return load_spec(Path(spec), code_from=folder)
