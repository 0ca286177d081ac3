"""Run what is missing of a study and store it: what `sweep launch` does."""

from collections.abc import Callable, Sequence

from sweep.campaigns.campaign import run_campaign
from sweep.campaigns.fixed import FixedStrategy
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Strategy
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError
from sweep.spec.mistakes import Mistakes
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.store.shares import Share
from sweep.workers.executors import ExecutorFactory


def check_launches(studies: Sequence[Study], share: Share | None = None) -> None:
    """Raise one SpecError with all that `launch` would raise of these studies before it
    runs a trial.
    """
    mistakes = Mistakes()
    for study in studies:
        mistakes.read(_strategy, study, share, None)
    mistakes.check()


def check_flights(studies: Sequence[Study], executor: ExecutorFactory) -> None:
    """Raise one ChoiceError with all reasons why trials of these studies cannot fly
    where the engine flies them. Of a study where a rule adds points, only its first
    points are known now.
    """
    if executor.flying.device is None:  # a processor flies every trial
        return
    said = []
    for study in studies:
        try:
            executor.flying.check(study, Jobs(study, expand(study)))
        except ChoiceError as error:
            said.append(str(error))
    if said:
        raise ChoiceError("\n".join(said))


def launch(
    study: Study,
    results: Location,
    executor: ExecutorFactory,
    *,
    retry: bool = False,
    share: Share | None = None,
    report: Callable[[Progress], None] = lambda _progress: None,
) -> Progress:
    """Run the trials of `study` that its store below `results` lacks, and with `retry`
    those not done.

    The store's plan becomes that of this spec; trials of an earlier one stay stored,
    apart. Where a section of a method has a strategy, the plan lists what it has asked
    for so far. With a `share`, only the trials in it are run, while other launches may
    run the others. Raises SpecError for
    a design that cannot be, or be shared; otherwise as `run_campaign`, which says also
    when `report` is called.
    """
    return run_campaign(
        _strategy(study, share, results),
        results,
        executor,
        share=share,
        retry=retry,
        report=report,
    )


def _strategy(
    study: Study, share: Share | None, results: Location | None
) -> Strategy[Progress]:
    if study.strategic is None:
        return FixedStrategy(study)
    section, value = study.strategic
    if share:
        message = (
            "what trials follow depends on all that are stored:"
            " this study cannot be launched in shares"
        )
        raise study.document.error(section.place, message)
    assert section.strategy
    strategy: Strategy[Progress] = section.strategy(study, value, results)
    return strategy
