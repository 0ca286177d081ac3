"""Campaigns: strategies that request the trials of a study, and the driver.

A strategy requests all trials of a design, or trials that a method selects.

plan             the plan of any study, for `sweep plan`
launching        the entry point of `sweep launch`

campaign         the driver: ask a strategy, run the missing trials, ask again
strategy         the interface between driver and strategy
fixed            a strategy: an equal number of trials for every point

design_plan      the plan of a study with points from axes
stored_trials    the stored trials of a study, before and during a launch

twins            trials that run again, compared with stored results
measuring        further metrics of stored trials: `sweep measure`

further_metrics  the metrics requested of `sweep measure`
warming          compilation ahead of a launch
progress         the progress of a campaign, and its display
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
