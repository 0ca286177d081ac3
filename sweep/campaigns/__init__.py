"""Which trials of a study run: all of its plan, or those that a method asks for.

plan           what `sweep plan` says of a study
launch         what `sweep launch` does
campaign       the driver: asks a strategy, runs what is missing, asks again
strategy       what the driver needs of a strategy
fixed          a strategy: the same number of trials for every point
design_plan    the plan of a study whose points come from its axes
stored_trials  what is stored when a launch begins, and what it adds
twins          trials that run again, compared with what is stored of them
measure        further metrics of what is stored: `sweep measure`
further_metrics  the metrics that it is asked for
warming        what is compiled ahead
progress       how far a campaign is, and what shows it
"""
