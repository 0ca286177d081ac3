"""The entry points of `sweep launch` and `sweep search`.

Both run the missing trials of a study and store them.
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
    """Raise one SpecError with all errors that `launch` would raise for studies.

    The errors are those before a trial runs.
    """
    mistakes = Mistakes()
    for study in studies:
        mistakes.read(_strategy, study, share)
    mistakes.check()


def check_flights(studies: Sequence[Study], executor: ExecutorFactory) -> None:
    """Raise one ChoiceError if the engine cannot run trials of these studies.

    The error has all reasons. If a rule adds points to a study, only its first points
    are known now.
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
    """Run the trials of a study that are not stored yet.

    The plan of the store becomes that of this spec. Trials of an earlier plan stay
    stored, apart. If a rule adds trials or points, the plan lists those requested so
    far.

    Parameters
    ----------
    study : Study
        The study; it must not be a search.
    results : Location
        Folder of results; the store of the study is below it.
    executor : ExecutorFactory
        Engine that runs the trials.
    retry : bool, default False
        Run trials again that are stored but not done.
    share : Share, optional
        The shard to run, while other launches may run the others.
    report : callable, optional
        Called with the progress, as `run_campaign` calls it.

    Returns
    -------
    Progress

    Raises
    ------
    SpecError
        If the study is a search, its design is not possible, or it cannot be launched
        in shards.
    StoreError, ChoiceError, FailedTrialsError, KeyboardInterrupt
        As `run_campaign`.
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
    """Run a search, and judge its best candidates on held-out seeds.

    Each repetition, and as many random searches, run and are judged in the same way.
    Stored trials do not run again, with `retry` only if they are done.

    Parameters
    ----------
    study : Study
        The study; it must be a search.
    results : Location
        Folder of results; the store of the study is below it.
    executor : ExecutorFactory
        Engine that runs the trials.
    repetitions : int, optional
        Number of repetitions. By default as many as the stored search of this very spec
        has, or none.
    retry : bool, default False
        Run trials again that are stored but not done.
    report : callable, optional
        Called with the progress, as `run_campaign` calls it.

    Returns
    -------
    SearchProgress

    Raises
    ------
    SpecError
        If the study is no search, or the search is not possible.
    StoreError, ChoiceError, FailedTrialsError, KeyboardInterrupt
        As `run_campaign`.
    """
    if repetitions is None:
        repetitions = stored_repetitions(study, results)
    strategy = SearchStrategy(study, repetitions)
    return run_campaign(strategy, results, executor, retry=retry, report=report)
