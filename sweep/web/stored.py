"""The stored trials of a study, for a page that moves between trials.

The page moves by swept values and replicate, or in the order of points and replicates.
"""

from bisect import bisect_left, bisect_right
from functools import cached_property
from pathlib import Path

import numpy as np

from sweep.design import Job
from sweep.errors import SpecError, UserError
from sweep.spec import Value
from sweep.tables import StoredStudy
from sweep.web.controls import Place, offered, placed
from sweep.web.opened import opened_again, point_having
from sweep.web.protocol import Reply
from sweep.web.state import ViewState, from_job, from_opened


def from_stored(study: StoredStudy, job: Job) -> ViewState:
    """Return the state that shows a stored trial again, as a trial of the study's spec.

    If the spec no longer gives this trial, the trial is shown alone. The cause is a
    change of the kernels, of the program or of a table next to the spec.
    """
    path = Path(str(study.provenance.get("spec_path", "spec.yaml")))
    try:
        trial = (job.point, job.replicate)
        spec = opened_again(study.spec, *trial, catalogue=job.catalogue, path=path)
    except UserError:
        return from_job(job)
    same = spec.job.trial_id == job.trial_id
    return from_opened(spec) if same else from_job(job)


class TrialChoice:
    """The trials of `study` that are stored.

    A trial is named by the index of the point and by the replicate, each from 0.
    """

    def __init__(self, study: StoredStudy) -> None:
        self.study = study
        ids = study.points.index.tolist()
        self.points = {str(point): number for number, point in enumerate(ids)}
        self.columns = {name: study.points[name].to_numpy() for name in study.varied}

    @cached_property
    def replicates(self) -> int:
        """The largest planned number of trials per point."""
        return int(np.max(self.study.plan["replicate"].to_numpy(), initial=0)) + 1

    @cached_property
    def ids(self) -> dict[Place, str]:
        """The ids of stored trials by point and replicate."""
        trials = self.study.trials
        points = [self.points[point] for point in trials["point"].tolist()]
        places = zip(points, trials["replicate"].tolist(), strict=True)
        return dict(zip(places, trials["trial_id"].tolist(), strict=True))

    @cached_property
    def places(self) -> list[Place]:
        """The point and the replicate of each stored trial, in order."""
        return sorted(self.ids)

    def offered(self) -> Reply:
        """Return the trials of the controls message."""
        points = len(self.points)
        axes = (self.study.about.axes or {}).values()
        return offered(
            self.study.name,
            self.columns,
            points,
            self.replicates,
            drawn=[name for axis in axes if axis.sampler for name in axis.settings],
        )

    def place(self, job: Job) -> Place:
        """Return the point and the replicate of a trial."""
        return self.points[job.point], job.replicate

    def placed(self, job: Job) -> Reply:
        """Return the trial of the state message, with the adjacent stored trials."""
        here = self.place(job)
        places = self.places
        neighbours = (
            places[k] if 0 <= k < len(places) else None
            for k in (bisect_left(places, here) - 1, bisect_right(places, here))
        )
        values = {name: column.item(here[0]) for name, column in self.columns.items()}
        return placed(here, values, *neighbours)

    def trial(self, point: int, replicate: int) -> str:
        """Return the id of a stored trial.

        Parameters
        ----------
        point : int
            Index of the point.
        replicate : int
            Number of the replicate, from 0.

        Raises
        ------
        SpecError
            If this trial is not stored.
        """
        if (point, replicate) not in self.ids:
            where = f"point {point:,}, replicate {replicate:,}"
            raise SpecError(f"no trial is stored for {where}")
        return self.ids[point, replicate]

    def having(self, job: Job, name: str, value: Value) -> str:
        """Return the id of the trial at the point with this value of a parameter.

        The trial has the replicate of `job`. Among several points, the method chooses
        the point that has most values in common with the point of `job`.

        Parameters
        ----------
        job : Job
            The trial to start from.
        name : str
            Parameter that varies.
        value : int, float, str or bool
            Value of the parameter.

        Raises
        ------
        SpecError
            If no such trial is stored, or the parameter does not vary.
        """
        point = point_having(self.columns, self.place(job)[0], name, value)
        return self.trial(point, job.replicate)
