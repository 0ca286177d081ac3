"""Searches for good settings: candidates are asked of a sampler, raced against each
other, and judged on new seeds.

A candidate is a setting of the parameters, a scenario one point of what it must be good
at together, and a block one replicate in every scenario. Block k has the same random
numbers for every candidate.

    run          the search, its repetitions, the held-out trials
    loop         ask, race and tell, until the budget is spent
    samplers     who proposes candidates
    candidates   their trials
    racing       who gets no more trials
    blocks       trials by block and scenario
    ledger       what is known of trials
    stored       asked.parquet, beside them
    outcome      who is chosen
    fronts       Pareto fronts, hypervolume
    held_out     judged on new seeds
    repetitions  against random search
    findings     all that is to be said
    words        the same in plain words
    plan         what it would run at most
    export       a study of optuna
"""
