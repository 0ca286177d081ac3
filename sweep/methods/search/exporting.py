"""A search as a study of optuna, in any storage of optuna, for dashboard and plots."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from sweep.errors import OutputError
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.findings import plain
from sweep.methods.search.held_out import held_out_values
from sweep.methods.search.objectives import Constraint, Objective
from sweep.methods.search.outcome import (
    FAILED,
    HELD_OUT,
    SEARCH,
    candidates,
    constraints,
    objectives,
    trials_of,
)
from sweep.methods.search.samplers import distributions, quiet
from sweep.methods.search.section_keys import Parameter
from sweep.methods.search.trials_by_block import TrialsByBlock
from sweep.tables import StoredStudy

PASSWORD = "SWEEP_EXPORT_PASSWORD"

if TYPE_CHECKING:
    from optuna.distributions import BaseDistribution
    from optuna.storages import RDBStorage
    from optuna.trial import FrozenTrial


def export(study: StoredStudy, url: str, name: str | None = None) -> str:
    """Write the main search into a storage of optuna.

    Candidates with most blocks are complete trials of optuna, so that the best trial of
    optuna is the winner of the search. Failed candidates are failed trials, and all
    further candidates are pruned trials. With one objective, the intermediate values of
    a trial are the estimates after 1, 2, ... blocks. User attributes are candidate,
    batch, status, blocks, trial_ids, and for judged candidates held_out.

    Parameters
    ----------
    study : StoredStudy
        The stored search.
    url : str
        URL of the database, such as `sqlite:///gains.db`. The password is the value of
        the variable SWEEP_EXPORT_PASSWORD, never a part of the URL, which messages
        show.
    name : str, optional
        Name of the study in the storage; by default the name of `study`.

    Returns
    -------
    str
        Name of the study in the storage.

    Raises
    ------
    ChoiceError
        If the study is not a search.
    OutputError
        If the storage cannot be written, or already has a study of this name, which
        stays unchanged.
    """
    asked_trials = read_asked(study)
    name = name or study.name
    with quiet():
        import optuna

        kinds = optuna.study.StudyDirection
        directions = [
            kinds.MAXIMIZE if objective.maximize else kinds.MINIMIZE
            for objective in objectives(asked_trials)
        ]
        trials = list(_trials(asked_trials))
        with _storage(url) as storage:
            _check_free(storage, url, name)
            written = optuna.create_study(
                storage=storage, study_name=name, directions=directions
            )
            try:
                written.set_metric_names(
                    [objective.column for objective in objectives(asked_trials)]
                )
                written.set_user_attr(
                    "boidsweep", {"study": study.name, "spec": study.spec}
                )
                written.add_trials(trials)
            except BaseException:
                optuna.delete_study(study_name=name, storage=storage)
                raise
    return name


def check_export(url: str, name: str) -> None:
    """Raise OutputError, before any work, if `export` to this URL would raise it."""
    with quiet(), _storage(url) as storage:
        _check_free(storage, url, name)


def _check_free(storage: "RDBStorage", url: str, name: str) -> None:
    try:
        storage.get_study_id_from_name(name)  # all other data stay unread
    except KeyError:
        return
    raise OutputError(
        f'{url}: already has a study "{name}", which stays unchanged; give another'
        f' URL, or delete the study with "optuna delete-study --storage {url}'
        f' --study-name {name}"'
    )


@contextmanager
def _storage(url: str) -> "Iterator[RDBStorage]":
    """Open the storage at `url`, and close it at the end. Raises OutputError."""
    from optuna.exceptions import DuplicatedStudyError, StorageInternalError
    from optuna.storages import RDBStorage
    from sqlalchemy.exc import SQLAlchemyError

    example = "allowed: the URL of a database, such as sqlite:///gains.db"
    try:
        storage = RDBStorage(_with_password(url, example))
    except (SQLAlchemyError, ImportError, ValueError, RuntimeError) as error:
        raise OutputError(
            f"{url}: cannot be opened ({_first_line(error)}); {example}"
        ) from error
    try:
        yield storage
    except (SQLAlchemyError, StorageInternalError, DuplicatedStudyError) as error:
        raise OutputError(
            f"{url}: cannot be written ({_first_line(error.__cause__ or error)})"
        ) from error
    finally:
        storage.remove_session()
        storage.engine.dispose()


def _with_password(url: str, example: str) -> str:
    """Return the URL with the password of the environment.

    Raises OutputError for a URL with a password, without the password in the message.
    Other users of a machine can read the arguments of a command, and shells and logs
    keep them.
    """
    from sqlalchemy.engine import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError):  # the message may have a part of a password
        shown = f"{url.partition('://')[0]}://..." if "://" in url else url
        raise OutputError(
            f"{shown}: not the URL of a storage of optuna; {example}"
        ) from None
    secret = parsed.password is not None or any(
        "passw" in key.lower() for key in parsed.query
    )
    if secret:
        plain = parsed.set(query={}).render_as_string(hide_password=True)
        raise OutputError(
            f"--export {plain}: other users can read a URL with a password in the list"
            f" of processes; remove the password, and set the variable {PASSWORD}"
        )
    if parsed.username and (password := os.environ.get(PASSWORD)):
        parsed = parsed.set(password=password)
    return parsed.render_as_string(hide_password=False)


def _first_line(error: BaseException) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]


def _trials(asked_trials: AskedTrials) -> "Iterator[FrozenTrial]":
    """Yield the candidates of the main search as optuna trials, in the order asked."""
    table = candidates(asked_trials)
    searched = trials_of(asked_trials, SEARCH, "search")
    judged = trials_of(asked_trials, SEARCH, HELD_OUT)
    ranges = {
        name: next(iter(spread.items()))
        for name, spread in asked_trials.description["ranges"].items()
    }
    asking = distributions(
        tuple(
            Parameter(name, form, tuple(values))
            for name, (form, values) in ranges.items()
        )
    )
    rows = asked_trials.table[
        (asked_trials.table["run"] == SEARCH)
        & (asked_trials.table["phase"] == "search")
    ]
    ids = (
        rows.sort_values(["candidate", "block", "scenario"])
        .groupby("candidate")["trial_id"]
        .agg(list)
    )
    most = table.loc[table["status"] != FAILED, "blocks"].max()
    aims = objectives(asked_trials)
    bounds = constraints(asked_trials)
    for place, row in enumerate(table.to_dict("records")):
        attributes = {
            name: plain(row[name])
            for name in ("candidate", "batch", "status", "blocks")
        }
        attributes["trial_ids"] = ids[row["candidate"]]
        if row["candidate"] in judged.candidates:
            values = held_out_values(judged, [int(row["candidate"])], aims)[0]
            attributes["held_out"] = {
                aim.column: plain(value)
                for aim, value in zip(aims, values, strict=True)
            }
        settings = {str(name): plain(row[name]) for name in asking}
        yield _trial(
            settings,
            asking,
            attributes,
            estimates=_estimates(searched, place, aims),
            limits=_limits(searched, place, bounds),
            most=int(most),
        )


def _trial(
    settings: dict[str, Any],
    asking: "dict[str, BaseDistribution]",
    attributes: dict[str, Any],
    estimates: list[list[float]],
    limits: dict[str, float],
    most: int,
) -> "FrozenTrial":
    """Return one trial; `estimates` has the objectives after each block."""
    from optuna.trial import TrialState, create_trial

    finite = bool(estimates) and bool(np.isfinite(estimates[-1]).all())
    if attributes["status"] == FAILED or not finite:
        return create_trial(
            state=TrialState.FAIL,
            params=settings,
            distributions=asking,
            user_attrs=attributes,
        )
    steps = (
        {step: values[0] for step, values in enumerate(estimates)}
        if len(estimates[-1]) == 1
        else None
    )
    complete = attributes["blocks"] == most
    return create_trial(
        state=TrialState.COMPLETE if complete else TrialState.PRUNED,
        values=estimates[-1],
        params=settings,
        distributions=asking,
        user_attrs=attributes,
        intermediate_values=steps,
        constraints=limits or None,
    )


def _estimates(
    searched: TrialsByBlock, place: int, aims: list[Objective]
) -> list[list[float]]:
    """Return the estimates of a candidate after 1, 2, ... of its blocks."""
    columns = [(objective, searched.of(place, objective.column)) for objective in aims]
    number = int(searched.counts()[place])
    return [
        [objective.value(values[: k + 1]) for objective, values in columns]
        for k in range(number)
    ]


def _limits(
    searched: TrialsByBlock, place: int, bounds: list[Constraint]
) -> dict[str, float]:
    """Return the known violations of a candidate, by column and statistic."""
    each = {
        f"{constraint.column} {constraint.statistic}": constraint.violation(
            searched.of(place, constraint.column)
        )
        for constraint in bounds
    }
    return {name: value for name, value in each.items() if not np.isnan(value)}
