"""What `sweep.load` and `sweep.run` return: a stored study, with what its search found
and which settings matter.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from sweep.analysis import CONFIDENCE, MeanKind
from sweep.analysis.replication import CHANCE
from sweep.campaigns.search.asked_trials import read_asked
from sweep.campaigns.search.findings import Findings
from sweep.errors import ChoiceError
from sweep.method import methods
from sweep.methods.adaptive import stopping
from sweep.methods.power import NOTHING, needed_replicates
from sweep.methods.refinement import Boundary, find_boundary
from sweep.methods.robustness import Validity, check_conclusions
from sweep.methods.scaling import Scaling, finite_size_scaling
from sweep.methods.sensitivity import RESAMPLES, sensitivity
from sweep.spec.recorded import Over, column_over, is_half
from sweep.spec.sampling import Analyses
from sweep.tables.arrays import to_arrays
from sweep.tables.exporting import Exported, export
from sweep.tables.point_means import point_means
from sweep.tables.reports import Report
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

if TYPE_CHECKING:
    import xarray as xr


class LoadedStudy(StoredStudy):
    """A stored study as notebooks and programs have it."""

    @cached_property
    def search(self) -> Findings:
        """What a search has found: `candidates`, `winners`, `references`,
        `differences`, `front` and `against`, each a table computed when first asked
        for.

        Raises ChoiceError where the study is no search, or was restricted by `where`.
        """
        return Findings(self, read_asked(self))

    def table(
        self,
        metrics: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] | None = None,
        sort: str | Sequence[str] = (),
        over: Over = "last",
        interval: MeanKind | None = None,
        half: bool = False,
    ) -> pd.DataFrame:
        """Means of the metrics with 95 % intervals, a row a point, or a row for all
        points that agree in the settings `by`: see
        `sweep.tables.point_means.point_means`. `where` chooses points before.

        `over` is "last" or "half": the last frame of a trial, or the mean over its last
        half. `half=True` is the older form of `over="half"`, here and elsewhere.
        """
        found = point_means(
            self,
            metrics,
            by=by,
            sort=sort,
            half=is_half(over, half),
            interval=interval,
        )
        return found.rows

    def power(
        self,
        half_width: Mapping[str, float | str] = NOTHING,
        difference: Mapping[str, float | str] = NOTHING,
        *,
        against: StoredStudy | None = None,
        over: Over = "last",
        chance: float = CHANCE,
        half: bool = False,
    ) -> pd.DataFrame:
        """How many replicates each point needs for 95 % intervals of so narrow a
        `half_width`, a number or a share of the mean, {"speed": 0.05, "coverage":
        "5%"}, and for a comparison that notices so large a `difference`, with these
        trials as the pilot: see `sweep.methods.power.needed_replicates`.

        A difference is one of each point to the first one, or of `against` to these
        trials: `study.where(n=50).power({}, {"speed": "5%"},
        against=study.where(n=100))`.
        """
        widths, sizes = (
            [f"{name}={size}" for name, size in asked.items()]
            for asked in (half_width, difference)
        )
        found = needed_replicates(
            self,
            against,
            half_widths=widths,
            differences=sizes,
            half=is_half(over, half),
            chance=chance,
        )
        return found.rows

    @property
    def stopping(self) -> pd.DataFrame:
        """When and why points got their last trials, of a study that adds trials until
        intervals are narrow: see `sweep.methods.adaptive.stopping`.

        Raises ChoiceError for another study.
        """
        return stopping(self)

    def boundary(self) -> Boundary:
        """Where the mean of a metric crosses a level, of a study whose spec has
        `refine`: see `sweep.methods.refinement.find_boundary`. Raises ChoiceError for
        another.
        """
        return find_boundary(self)

    def scaling(
        self,
        metric: str | None = None,
        by: str | None = None,
        burn_in: int | None = None,
        confidence: float = CONFIDENCE,
    ) -> Scaling:
        """What flocks of several sizes tell of a transition: see
        `sweep.methods.scaling.finite_size_scaling`. Raises ChoiceError for a study that
        has none.
        """
        return finite_size_scaling(self, metric, by, burn_in, confidence)

    def validity(
        self,
        metrics: str | Sequence[str] = (),
        *,
        over: Over = "last",
        confidence: float = CONFIDENCE,
        half: bool = False,
    ) -> Validity:
        """Whether the conclusions of a study whose spec has `validate` hold in each of
        its variants: see `sweep.methods.robustness.check_conclusions`.
        """
        return check_conclusions(
            self, metrics, half=is_half(over, half), confidence=confidence
        )

    def report(self, name: str, **options: Any) -> Report:
        """Return the report that a command prints of this study.

        Parameters
        ----------
        name
            The command, such as "hysteresis" or "resilience".
        options
            Its options, such as `metric=["speed"], over="half"`.

        Returns
        -------
        Report
            With `rows`, `to_csv()`, `to_json()` and `to_latex()`.

        Raises
        ------
        ChoiceError
            There is no such report, or the study has nothing of it.
        """
        known = {
            make.__name__: make
            for method in methods().values()
            for make in method.reports
        }
        if name not in known:
            raise ChoiceError(unknown("report", name, known), self.name)
        report: Report = known[name](self, **options)
        return report

    def export(
        self,
        path: Path | str,
        table: str = "trials",
        *,
        trials: str | Sequence[str] = (),
        columns: str | Sequence[str] = (),
        force: bool = False,
    ) -> Exported:
        """Write a table of these trials, and of no others, as one file for other
        programs: see `sweep.tables.exporting.export`.
        """
        return export(
            self, Path(path), table, trials=trials, columns=columns, force=force
        )

    def to_xarray(self, table: str = "trials") -> "xr.Dataset":
        """A table as an xarray.Dataset with units, its dimensions the axes of the study
        and `replicate`: see `sweep.tables.arrays`.
        """
        return to_arrays(self, table)

    def sensitivity(
        self,
        metric: str,
        axis: str | None = None,
        analysis: Analyses | None = None,
        *,
        over: Over = "last",
        confidence: float = CONFIDENCE,
        resamples: int = RESAMPLES,
        seed: int = 0,
    ) -> pd.DataFrame:
        """Which settings of a sampled axis `metric` depends on, as
        `sweep.methods.sensitivity.sensitivity` has it.
        """
        return sensitivity(
            self,
            column_over(metric, over),
            axis,
            analysis,
            confidence=confidence,
            resamples=resamples,
            seed=seed,
        )
