"""The entry point of `sweep launch`, which runs and stores the missing trials."""

from collections.abc import Callable, Sequence

from sweep.campaigns.campaign import run_campaign
from sweep.campaigns.fixed import FixedStrategy
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Strategy
from sweep.design import Jobs, expand
from sweep.errors import ChoiceError
from sweep.spec import Mistakes, Study
from sweep.store import Location, Share
from sweep.workers import ExecutorFactory


def check_launches(studies: Sequence[Study], share: Share | None = None) -> None:
    """Raise one SpecError with all errors that `launch` would raise for studies.

    The error covers only mistakes that are found before the first trial.
    """
    mistakes = Mistakes()
    for study in studies:
        mistakes.read(_strategy, study, share, None)
    mistakes.check()


def check_flights(studies: Sequence[Study], executor: ExecutorFactory) -> None:
    """Raise one ChoiceError if the engine cannot run trials of some studies.

    The error has all reasons. If a rule adds points to a study, only the first points
    are known now. If a strategy requests further points, only similar points are
    checked.
    """
    if executor.flying.device is None:  # a processor runs every trial
        return
    reasons = []
    for study in studies:
        try:
            first = study.stand_in
            executor.flying.check(first, Jobs(first, expand(first)))
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

    The plan of the store becomes the plan of this spec. Trials of an earlier plan
    remain stored, apart. If a section of the spec has a strategy, the plan lists the
    trials requested so far.

    Parameters
    ----------
    study : Study
    results : Location
        Folder of results; the store of the study is below it.
    executor : ExecutorFactory
        Engine that runs the trials.
    retry : bool, default False
        Run trials again that are stored but not done.
    share : Share, optional
        The shard to run; further launches may run the remaining shards.
    report : callable, optional
        Called with the progress; see `run_campaign`.

    Returns
    -------
    Progress

    Raises
    ------
    SpecError
        If the design of the study is not possible, or the study cannot be launched in
        shards.
    StoreError, ChoiceError, FailedTrialsError, KeyboardInterrupt
        As `run_campaign`.
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
    if study.strategy_section is None:
        return FixedStrategy(study)
    section, value = study.strategy_section
    if share:
        message = (
            "the next trials depend on all stored trials:"
            " this study cannot be launched in shards"
        )
        raise study.document.error(section.place, message)
    assert section.strategy
    strategy: Strategy[Progress] = section.strategy(study, value, results)
    return strategy
