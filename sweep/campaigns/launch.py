"""Run what is missing of a study and store it: what `sweep launch` and `sweep search`
do.
"""

from collections.abc import Callable, Sequence

from sweep.campaigns.campaign import run_campaign
from sweep.campaigns.fixed import FixedStrategy
from sweep.campaigns.progress import Progress, SearchProgress
from sweep.campaigns.search.asked_trials import stored_repetitions
from sweep.campaigns.search.strategy import SearchStrategy
from sweep.campaigns.strategy import Strategy
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError
from sweep.spec.mistakes import Mistakes
from sweep.spec.study import Study, sections
from sweep.store.locations import Location
from sweep.store.shares import Share
from sweep.workers.executors import ExecutorFactory


def check_launches(studies: Sequence[Study], share: Share | None = None) -> None:
    """Raise one SpecError with all that `launch` would raise of these studies before it
    runs a trial.
    """
    mistakes = Mistakes()
    for study in studies:
        mistakes.read(_strategy, study, share)
    mistakes.check()


def check_flights(studies: Sequence[Study], executor: ExecutorFactory) -> None:
    """Raise one ChoiceError with all reasons why trials of these studies cannot fly
    where the engine flies them. Of a study where a rule adds points, only its first
    points are known now.
    """
    if executor.flying.device is None:  # a processor flies every trial
        return
    reasons = []
    for study in studies:
        try:
            executor.flying.check(study, Jobs(study, expand(study)))
        except ChoiceError as error:
            reasons.append(str(error))
    if reasons:
        raise ChoiceError("\n".join(reasons))


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
    apart. Where a rule adds trials or points, the plan lists what the looks so far have
    asked for. With a `share`, only the trials in it are run, while other launches may
    run the others. Raises SpecError for a study that is a search, and for
    a design that cannot be, or be shared; otherwise as `run_campaign`, which says also
    when `report` is called.
    """
    return run_campaign(
        _strategy(study, share),
        results,
        executor,
        share=share,
        retry=retry,
        report=report,
    )


def _strategy(study: Study, share: Share | None) -> Strategy[Progress]:
    if study.search:
        raise study.document.error(
            ("search",), 'this study is a search: run it with "sweep search"'
        )
    if share and study.rule:
        message = (
            "what trials follow depends on all that are stored:"
            " this study cannot be launched in shares"
        )
        raise study.document.error(study.rule.place, message)
    for key, value in study.sections.items():
        if make := sections()[key].strategy:
            strategy: Strategy[Progress] = make(study, value)
            return strategy
    return FixedStrategy(study)


def search(
    study: Study,
    results: Location,
    executor: ExecutorFactory,
    *,
    repetitions: int | None = None,
    retry: bool = False,
    report: Callable[[SearchProgress], None] = lambda _progress: None,
) -> SearchProgress:
    """Search, judge the best candidates on held-out seeds, and do the same for each of
    the `repetitions`, and for as many random searches. None is as many as the stored
    search of this very spec has, or none.

    What is stored below `results` is not run again, with `retry` only if it is done.
    Raises SpecError for a study that is no search, and for a search that cannot be;
    otherwise as `run_campaign`, which says also when `report` is called.
    """
    if repetitions is None:
        repetitions = stored_repetitions(study, results)
    strategy = SearchStrategy(study, repetitions)
    return run_campaign(strategy, results, executor, retry=retry, report=report)
