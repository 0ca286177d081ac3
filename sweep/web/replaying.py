"""A stored trial as a Show.

The trial runs again from the stored row, and is compared with the stored values. The
page can go to any step of the trial. The simulation is moved to the shown step, so a
replay shows everything that a live run shows.
"""

from contextlib import suppress
from typing import Any

from sweep.design import Job
from sweep.errors import SpecError, StoreError, UserError
from sweep.replays import Report, differences
from sweep.tables import StoredStudy
from sweep.text import numbered
from sweep.trial import Taken, simulate
from sweep.web import messages
from sweep.web.course import RUNS
from sweep.web.filing import Order
from sweep.web.flight import silent
from sweep.web.live_show import Live, do
from sweep.web.messages import Message
from sweep.web.protocol import Reply
from sweep.web.state import ViewState, from_job
from sweep.web.stored import TrialChoice
from sweep.web.track import NOTHING, go_to, quiet, survey

CHANGING = (
    messages.Set
    | messages.ChooseModel
    | messages.Shapes
    | messages.Goal
    | messages.Sweep
    | messages.Continue
    | messages.Undo
    | messages.Redo
)
FIXED = (
    "a stored trial cannot be changed; copy the spec and view the copy as a live run"
)
AS_STORED = "Every number equals the stored one, bit for bit."


class Replay(Live):
    """The replay of a stored trial, at step 0.

    `differences` lists the differences from the stored values.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    trial : str
        Id of the trial.
    report : callable, optional
        Called with the number of steps done and the number of all steps.

    Raises
    ------
    ChoiceError
        If the study does not have this trial.
    StoreError
        If the map of the trial is no longer known, or the trial fails.
    SpecError
        If the trial has more boids than can be shown.
    """

    def __init__(self, study: StoredStudy, trial: str, report: Report = silent) -> None:
        self.study = study
        self.choice = TrialChoice(study)
        super().__init__(self._load(trial, report))

    def _load(self, trial: str, report: Report = silent) -> ViewState:
        """Run a trial again and compare the result; a failure changes no attribute."""
        study = self.study
        stored = study.trial(trial)
        job = study.job(stored)
        state = from_job(job)
        try:
            track = survey(job, _measured(job), report)
            differing = differences(study.name, stored, simulate(job))
        except Exception as error:
            if isinstance(error, UserError):
                raise
            reason = f"{type(error).__name__}: {error}"
            raise StoreError(
                f"trial {trial} cannot be shown, because the trial fails: {reason}"
            ) from error
        self.stored = stored
        self.job = job
        self.track = track
        self.differences = differing
        return state

    @property
    def which(self) -> str:
        """The swept values and the replicate of the trial, in words."""
        names = self.study.varied
        values = [f"{name.replace('_', ' ')} {self.stored.row[name]}" for name in names]
        count = self.choice.replicates
        return ", ".join([*values, numbered("replicate", self.job.replicate, count)])

    def _begin(self, state: ViewState) -> None:
        self.running = False
        self.aim = 0
        self.exact = True
        self.note = ""
        self.diverged = False
        self.simulation = quiet(self.track.job, self.track.job.record)
        self._number = next(RUNS)
        self._plot(state)
        self.seek(0)
        self._count()

    @property
    def number(self) -> int:
        """The number of the run, different for each trial."""
        return self._number

    def _show(self, state: ViewState) -> None:
        self.state = state

    @property
    def past(self) -> tuple[int, int]:
        """The first and the last step."""
        return 0, self.track.last

    @property
    def restarts(self) -> list[int]:
        """The steps at which visits restart from 0: none of a stored trial."""
        return []

    def measure(self) -> None:
        """Tell the values of the present step, all of which are known."""
        here = slice(self.step, self.step + 1)
        values = {name: column[here] for name, column in self.track.values.items()}
        self.history.add(self.track.steps[here], values)

    def _count(self) -> None:
        """Repeat the run if the picture of visits is shown and none were counted."""
        if self.uncounted(self.state, self.overlays):
            counted = tuple(self.track.values)
            self.track = survey(self.job, counted, silent, visits=True)
            self.simulation = quiet(self.track.job, self.track.job.record)
            self.seek(self.step)

    def _plot(self, state: ViewState) -> None:
        """Plot the whole run at once, because all values are known."""
        self._show(state)
        self.history.begin(state.plots)
        self.history.add(self.track.steps, self.track.values)

    def seek(self, step: int) -> None:
        """Go to `step`, or to the last step if the run ended before `step`."""
        self.simulation = go_to(self.track, self.simulation, min(step, self.track.last))
        self._refresh()

    def advance(self, steps: int) -> Taken:
        """Take up to `steps` steps and return the frames.

        At the end the run pauses.
        """
        most = (self.track.last if self.running else self.aim) - self.step
        if min(steps, most) > 0:
            self.simulation.advance(min(steps, most))
        if self.step >= self.track.last:
            self.pause()
        taken = self.simulation.take_frames(NOTHING)
        self._refresh()
        return taken

    def run(self) -> None:
        """Run without a message for each step; at the end of the run, begin again."""
        if self.step >= self.track.last:
            self.seek(0)
        self.running = True

    def take_steps(self, count: int) -> None:
        """Ask for `count` more steps, but none after the last."""
        self.running = False
        self.aim = min(max(self.aim, self.step) + count, self.track.last)

    def reset(self) -> None:
        """Go back to the start."""
        self.seek(0)

    def follow(self, metrics: tuple[str, ...]) -> None:
        """Plot metrics of the whole run.

        If a metric was not measured yet, the whole run is repeated.
        """
        state = self.state.follow(metrics)
        missing = tuple(name for name in metrics if name not in self.track.values)
        if missing:
            values = self.track.values | survey(self.job, missing, silent).values
            self.track = self.track._replace(values=values)
        self._plot(state)
        self.version += 1

    def beside(self, _preset: str, /) -> Live:
        """Raise SpecError, because a stored trial has a fixed preset."""
        raise SpecError(FIXED)

    def restore(self, hello: messages.Hello) -> None:
        """Play the trial that a page has kept, if the trial belongs to this study.

        The exceptions of the class are raised.
        """
        if hello.kept_trial and hello.kept_study == self.study.name:
            self._begin(self._load(hello.kept_trial))

    def handle(self, message: Message) -> list[Reply]:
        """Handle a message of the page. Raises SpecError for a change of the replay."""
        match message:
            case messages.Seek(frame):
                self.pause()
                self.seek(frame)
                return [self.status()]
            case messages.ShowTrial(point, replicate):
                return self._show_stored(self.choice.trial(point, replicate))
            case messages.ShowValue(name, value):
                return self._show_stored(self.choice.having(self.job, name, value))
            case messages.Spec():
                return [
                    {
                        "type": "spec",
                        "yaml": self.spec(),
                        "trial": "",
                        "exact": True,
                        "note": "",
                    }
                ]
            case message if isinstance(message, CHANGING):
                raise SpecError(FIXED)
        return super().handle(message)

    def kept(self) -> Reply:
        """Return the trial with which the page resumes after the end of a session."""
        trial = {"kept_study": self.study.name, "kept_trial": self.job.trial_id}
        return {"type": "kept", "yaml": "", "point": "", "replicate": 0} | trial

    def _show_stored(self, trial: str) -> list[Reply]:
        """Play another stored trial, with the present plots if the trial has them."""
        plots = self.state.plots
        speed = self.speed
        self._begin(self._load(trial))
        self.speed = speed
        if plots != self.state.plots:
            with suppress(SpecError):
                self.follow(plots)
        return self.greeting()

    def greeting(self) -> list[Reply]:
        """Return controls, with the stored trials to choose from, scene and state."""
        controls, *rest = super().greeting()
        return [controls | {"trials": self.choice.offered()}, *rest]

    def waiting(self, message: Message) -> str:
        """Return the text for another trial, which runs again and may take long."""
        if isinstance(message, messages.ShowTrial | messages.ShowValue):
            return "running the trial again, to compare it with the stored values"
        return super().waiting(message)

    def _edit(self, message: Message) -> None:
        """Handle a message of the page, which does not edit the run."""
        do(self, message)

    def order(self) -> Order:
        """Return the content of the screen; a file of the run has the whole run."""
        return Order(
            study=self.study.name,
            job=self.job,
            step=self.step,
            bodies=self.bodies,
            metrics=tuple(self.track.values),
            until=self.track.last,
        )

    def spec(self) -> str:
        """Return the YAML that launches this trial, with all earlier replicates."""
        number = self.state.replicate + 1
        which = (
            f"the last of the {number:,} trials of this spec"
            if number > 1
            else "the trial of this spec"
        )
        return (
            f"# {which} is {self.job.trial_id} of"
            f" {self.study.name}\n{self.state.as_text()}"
        )

    def status(self) -> Reply:
        """Return the state message, with the replayed trial."""
        trial = self.choice.placed(self.job)
        return super().status() | {"replay": self._replayed(), "trial": trial}

    def _replayed(self) -> dict[str, Any]:
        row = self.stored.row
        values = self.track.values
        metrics = {
            name: {"stored": row[name], "replayed": float(values[name][-1])}
            for name in (*self.stored.metrics, *self.stored.derive)
            if row[name] is not None
        }
        return {
            "study": self.study.name,
            "trial": self.job.trial_id,
            "which": self.which,
            "replicate": self.job.replicate,
            "frames": [0, self.track.last, 1],
            "equal": not self.differences,
            "words": self._words(),
            "metrics": metrics,
        }

    def _words(self) -> str:
        """Return a sentence that compares the trial with the stored values."""
        if not self.differences:
            return AS_STORED
        if self.stored.row["status"] in ("timeout", "failed"):
            status = self.stored.row["status"]
            step = self.stored.row["last_step"]
            return (
                f"Stored as {status}, after step {step:,}: there is nothing to compare."
                " The page shows the repeated trial."
            )
        more = (
            f"; and {len(self.differences) - 1:,} more columns"
            if len(self.differences) > 1
            else ""
        )
        return f"The trial differs from the stored one: {self.differences[0]}{more}."


def _measured(job: Job) -> tuple[str, ...]:
    """Return the recorded metrics and the default metrics of the model.

    Default metrics that count visits are left out, because a world may have very many
    pixels.
    """
    catalogue = job.catalogue
    usual = catalogue.models[job.model].metrics
    own = (name for name in usual if not catalogue.metrics[name].covers)
    return tuple(dict.fromkeys((*job.record.names, *own)))
