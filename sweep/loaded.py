"""A stored study with its analyses, the result of `sweep.load` and `sweep.run`."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from sweep.analysis import CHANCE, CONFIDENCE, MeanKind
from sweep.errors import ChoiceError
from sweep.method import methods
from sweep.methods.adaptive import stopping
from sweep.methods.calibration import Odds, Posterior, odds, posterior
from sweep.methods.power import NOTHING, needed_replicates
from sweep.methods.refinement import Boundary, find_boundary
from sweep.methods.robustness import Validity, check_conclusions
from sweep.methods.scaling import Scaling, finite_size_scaling
from sweep.methods.search import Findings, read_asked
from sweep.methods.sensitivity import RESAMPLES, sensitivity
from sweep.spec import Analyses, Over, column_over, is_half
from sweep.tables import Exported, Report, StoredStudy, export, point_means, to_arrays
from sweep.text import unknown

if TYPE_CHECKING:
    import xarray as xr


class LoadedStudy(StoredStudy):
    """A stored study for notebooks and programs.

    The tables are `trials`, `series`, `heatmaps` and `trajectories`. A table is read at
    the first use. `where` selects trials: every method then analyses only the selected
    trials.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> strong = study.where("separation_weight >= 1")
    >>> strong.table("polarization")[["separation_weight", "polarization"]].round(2)
       separation_weight  polarization
    0                1.0          0.30
    1                2.0          0.58
    """

    @cached_property
    def search(self) -> Findings:
        """Findings of a search.

        The tables are `candidates`, `winners`, `references`, `differences`, `front` and
        `against`. A table is computed at the first use.

        Raises
        ------
        ChoiceError
            The study is not a search, or `where` has restricted the study.

        Examples
        --------
        >>> found = sweep.load("my/gains").search
        >>> found.winners[["candidate", "search", "held_out", "held_out_n"]].round(2)
           candidate  search  held_out  held_out_n
        0          5    0.50      0.59           4
        1          1    0.56      0.52           4
        """
        return Findings(self, read_asked(self))

    def posterior(self) -> Posterior:
        """Return the posterior of the parameters that data support.

        Raises
        ------
        ChoiceError
            The spec has no `calibrate`, or `where` has restricted the study.
        StoreError
            No simulation has all summaries yet.

        Examples
        --------
        >>> fit = sweep.load("my/fit").posterior()
        >>> fit.parameters[["parameter", "mean", "low", "high"]].round(2)
                   parameter  mean   low  high
        0  separation_weight  1.04  0.07  1.84
        >>> fit.draws.to_parquet("posterior.parquet")
        """
        return posterior(self)

    def odds(self, *studies: StoredStudy | str) -> Odds:
        """Return how probable this and other calibrated models are, given the data.

        Parameters
        ----------
        *studies : StoredStudy or str
            Studies with other models or priors, and with the same data; or their names
            in the same folder of results.

        Raises
        ------
        ChoiceError
            A study has no `calibrate`, is named twice, or has other data or summaries.
        StoreError
            A study has no simulation with all summaries yet.

        Examples
        --------
        >>> odds = sweep.load("my/fit").odds("my/wide_fit")
        >>> odds.models[["study", "probability"]].round(1)
                 study  probability
        0       my/fit          0.7
        1  my/wide_fit          0.3
        """
        results = self.store.results
        loaded = [
            StoredStudy(study, results) if isinstance(study, str) else study
            for study in studies
        ]
        return odds((self, *loaded))

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
        """Return means of metrics with 95 % confidence intervals.

        Parameters
        ----------
        metrics : str or sequence of str, optional
            By default all recorded metrics.
        by : str or sequence of str, optional
            Parameters: one row for all points that agree in them. By default one row
            per point.
        sort : str or sequence of str, optional
            Parameters or metrics to sort by, each with ":desc" after it for the largest
            first.
        over : {"last", "half"}, default "last"
            The last frame, or the mean over the second half of each trial.
        interval : {"t", "bootstrap", "bootstrap_t"}, optional
            The kind of confidence interval; by default the kind that the distribution
            of each metric determines.
        half : bool, default False
            The older form of `over="half"`.

        Returns
        -------
        DataFrame
            One row per point or group of points.

        Raises
        ------
        ChoiceError
            A metric is not recorded, a parameter of `by` does not vary, or the table
            has no column of `sort`. All mistakes are reported together.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> means = study.table("speed", sort="speed:desc")
        >>> means[["separation_weight", "speed", "speed_low", "speed_high"]].round(2)
           separation_weight  speed  speed_low  speed_high
        0                2.0   2.61       2.25        2.97
        1                0.5   1.86       1.44        2.28
        2                1.0   0.38       0.24        0.51
        """
        means = point_means(
            self,
            metrics,
            by=by,
            sort=sort,
            half=is_half(over, half),
            interval=interval,
        )
        return means.rows

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
        """Return the number of replicates that each point needs.

        The trials of the study are the pilot.

        Parameters
        ----------
        half_width : mapping, optional
            The half-width of the 95 % confidence interval by metric: a number, or a
            fraction of the mean such as "5%".
        difference : mapping, optional
            The smallest difference by metric that a comparison detects, in the same
            form. Without `against` each point is compared with the first point.
        against : StoredStudy, optional
            The other side of each difference.
        over : {"last", "half"}, default "last"
            The last frame, or the mean over the second half of each trial.
        chance : float, default 0.8
            Statistical power: the probability of reaching the goal.
        half : bool, default False
            The older form of `over="half"`.

        Returns
        -------
        DataFrame
            One row per goal, metric and point, with `replicates` and their 95 % range.

        Raises
        ------
        ChoiceError
            A metric is not recorded, the sides cannot be compared, a goal or `chance`
            is not valid, or no point has enough values.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> needed = study.power({"speed": 0.5})
        >>> needed[["separation_weight", "values", "replicates"]]
           separation_weight  values  replicates
        0                0.5      10        12.0
        1                1.0      10         4.0
        2                2.0      10        10.0
        >>> weak = study.where(separation_weight=0.5)
        >>> strong = study.where(separation_weight=2)
        >>> strong.power({}, {"speed": 0.5}, against=weak)["replicates"].tolist()
        [20.0]
        """
        half_widths = [f"{name}={size}" for name, size in half_width.items()]
        differences = [f"{name}={size}" for name, size in difference.items()]
        power = needed_replicates(
            self,
            against,
            half_widths=half_widths,
            differences=differences,
            half=is_half(over, half),
            chance=chance,
        )
        return power.rows

    @property
    def stopping(self) -> pd.DataFrame:
        """Trials at which adaptive replicates stopped, and the reasons, by point.

        Columns: `point`, `metric`, `n`, `values`, `undefined`, `half_width`, `allowed`,
        `reached` and `why`. See `sweep.methods.adaptive.stopping`.

        Raises
        ------
        ChoiceError
            The study has a fixed number of trials.

        Examples
        --------
        >>> stopped = sweep.load("my/until").stopping
        >>> stopped[["metric", "values", "half_width", "allowed", "why"]].round(2)
          metric  values  half_width  allowed         why
        0  speed      10        0.29      0.3  half width
        1  speed      17        0.30      0.3  half width
        """
        return stopping(self)

    def boundary(self) -> Boundary:
        """Find where the mean of a metric crosses a level.

        Returns
        -------
        Boundary
            With the tables `points`, `cells` and `crossings`.

        Raises
        ------
        ChoiceError
            The spec of the study has no `refine`.

        Examples
        --------
        >>> study = sweep.load("my/edge")
        >>> found = study.boundary().crossings
        >>> found[["estimate", "low", "high", "direction"]].round(1)
           estimate  low  high direction
        0       3.4  1.0   5.0      down
        """
        return find_boundary(self)

    def scaling(
        self,
        metric: str | None = None,
        by: str | None = None,
        burn_in: int | None = None,
        confidence: float = CONFIDENCE,
    ) -> Scaling:
        """Estimate a transition from flocks of several sizes.

        Parameters
        ----------
        metric : str, optional
            The order parameter, a recorded series; by default the first one.
        by : str, optional
            The control parameter; by default the only number that varies in addition
            to `n` and the parameters that change with `n`.
        burn_in : int, optional
            Steps at the start of each trial that are left out; by default the first
            half of the trial.
        confidence : float, default 0.95
            The confidence level.

        Returns
        -------
        Scaling
            The curves of the sizes and the state of each point.

        Raises
        ------
        ChoiceError
            The study has one size or no series, other parameters vary, or there are
            too few trials.

        Examples
        --------
        >>> found = sweep.load("my/sizes").scaling("polarization", "noise")
        >>> found.states[["n", "noise", "trials", "tau", "burn_in"]].round(1)
            n  noise  trials  tau  burn_in
        0  16    2.0       4  1.1       10
        1  16    3.0       4  1.4       80
        ...
        """
        return finite_size_scaling(self, metric, by, burn_in, confidence=confidence)

    def validity(
        self,
        metrics: str | Sequence[str] = (),
        *,
        over: Over = "last",
        confidence: float = CONFIDENCE,
        half: bool = False,
    ) -> Validity:
        """Check the conclusions of a study in each variant that `validate` requests.

        Parameters
        ----------
        metrics : str or sequence of str, optional
            By default all recorded metrics.
        over : {"last", "half"}, default "last"
            The last frame, or the mean over the second half of each trial.
        confidence : float, default 0.95
            The simultaneous confidence level of all intervals (Bonferroni).
        half : bool, default False
            The older form of `over="half"`.

        Returns
        -------
        Validity
            `rows` has one row per conclusion and variant.

        Raises
        ------
        ChoiceError
            The spec has no `validate`, or a metric is unknown.
        StoreError
            A variant is not stored, or another spec has launched it.

        Examples
        --------
        >>> found = sweep.load("my/steps").validity("speed")
        >>> found.rows[["variant", "difference", "verdict", "outcome"]].round(2)
             variant  difference verdict   outcome
        0   as it is        0.35  higher
        1    dt-1of2        0.35  higher  survives
        2  all-pairs        0.35  higher  survives
        """
        return check_conclusions(
            self, metrics, half=is_half(over, half), confidence=confidence
        )

    def report(self, name: str, **options: Any) -> Report:
        """Return the report that a command prints for this study.

        Parameters
        ----------
        name : str
            The command, such as "hysteresis" or "resilience".
        **options
            Options of the command, such as `metric=["speed"], over="half"`.

        Returns
        -------
        Report
            With `rows`, `to_csv()`, `to_json()` and `to_latex()`.

        Raises
        ------
        ChoiceError
            There is no such report, or the study has no data for it.

        Examples
        --------
        >>> study = sweep.load("my/loop")
        >>> loops = study.report("hysteresis", metric=["polarization"])
        >>> loops.rows[["metric", "area", "low", "high", "chains"]].round(2)
                 metric  area   low  high  chains
        0  polarization  0.09 -0.67  0.85       3
        """
        reports = {
            make.__name__: make
            for method in methods().values()
            for make in method.reports
        }
        if name not in reports:
            raise ChoiceError(unknown("report", name, reports), self.name)
        report: Report = reports[name](self, **options)
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
        """Write one table of the trials as a file for other programs.

        Parameters
        ----------
        path : Path or str
            The new file; its ending determines the format: .parquet, .csv, .nc
            (netCDF) or .arrow.
        table : str, default "trials"
            "trials", "series", "heatmaps", "profiles" or "trajectories".
        trials : str or sequence of str, optional
            Ids of trials, or their beginnings; by default all trials.
        columns : str or sequence of str, optional
            Columns; by default all. "varied" selects the parameters that differ,
            "metrics" the values of metrics.
        force : bool, default False
            Replace a file that exists.

        Returns
        -------
        Exported
            The number of `rows`, the `sha256` of the file, and all `files`.

        Raises
        ------
        ChoiceError
            A table, trial, column or ending is unknown, the file exists without
            `force`, or there is nothing to export.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> written = study.export("trials.csv", columns="metrics", force=True)
        >>> written.rows, [file.name for file in written.files]
        (30, ['trials.csv', 'trials.csv.json', 'trials.csv.sha256'])
        """
        return export(
            self, Path(path), table, trials=trials, columns=columns, force=force
        )

    def to_xarray(self, table: str = "trials") -> "xr.Dataset":
        """Return a table as arrays with units.

        The dimensions are the axes of the study, `replicate`, and dimensions of the
        table such as `frame`. Points that are not a full product of the axes have a
        single dimension, `point`. Values of trials that are not stored are NaN, or "".

        Parameters
        ----------
        table : str, default "trials"
            "trials", "series", "heatmaps" or "trajectories".

        Returns
        -------
        xarray.Dataset
            The arrays.

        Raises
        ------
        ChoiceError
            The table is unknown, has no stored rows, or xarray is not installed.

        Examples
        --------
        >>> arrays = sweep.load("my/first").to_xarray()
        >>> dict(arrays.sizes)
        {'separation_weight': 3, 'replicate': 10}
        >>> arrays["polarization"].mean("replicate").round(2).values.tolist()
        [0.57, 0.3, 0.58]
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
        """Estimate how a metric depends on each parameter of a sampled axis.

        Parameters
        ----------
        metric : str
            The metric.
        axis : str, optional
            The sampled axis; needed if there are several.
        analysis : {"sobol", "morris", "ranks"}, optional
            Sobol indices, elementary effects or rank correlations; by default the
            analysis that suits the sampler.
        over : {"last", "half"}, default "last"
            The last frame, or the mean over the second half of each trial.
        confidence : float, default 0.95
            The confidence level of the intervals.
        resamples : int, default 1000
            The number of bootstrap resamples.
        seed : int, default 0
            The seed of the resamples.

        Returns
        -------
        DataFrame
            The table of `sobol`, `morris` or `rank_correlations` in
            `sweep.methods.sensitivity`.

        Raises
        ------
        ChoiceError
            No axis is sampled, or the analysis does not suit the sampler or metric.

        Examples
        --------
        >>> found = sweep.load("my/weights").sensitivity("speed")
        >>> found[["setting", "spearman", "spearman_low", "spearman_high"]].round(2)
                     setting  spearman  spearman_low  spearman_high
        0  separation_weight     -0.06         -0.51           0.36
        1    cohesion_weight      0.46          0.09           0.76
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
