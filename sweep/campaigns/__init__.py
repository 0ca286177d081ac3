"""Campaigns: the strategies that request the trials of a study, and their driver.

A strategy requests all trials of a design, or those that a method asks for.

plan             the plan of any study, as `sweep plan` prints it
launching        the entry point of `sweep launch`
campaign         the driver: ask a strategy, run the missing trials, ask again
strategy         the interface between driver and strategy
fixed            a strategy: the same number of trials for every point
design_plan      the plan of a study whose points come from its axes
stored_trials    the trials stored when a launch begins, and those it adds
twins            trials that run again, compared with their stored results
measuring        further metrics of stored trials: `sweep measure`
further_metrics  the metrics requested of `sweep measure`
warming          compilation ahead of a launch
progress         the progress of a campaign, and its display
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
