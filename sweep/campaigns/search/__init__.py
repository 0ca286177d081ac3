"""Searches for good parameters: candidates are proposed, raced and judged on new seeds.

A candidate is one set of values of the parameters that are searched over. A scenario is
one of the points over which a candidate must be good together. A block is one replicate
in every scenario; block k has the same random numbers for every candidate.

Modules that run:

    strategy         the search, its repetitions, and the held-out trials of each
    run              one run of these: ask, race and tell, until the budget is spent
    samplers         optuna, which proposes candidates
    candidates       from parameter values to trials; references; seeds
    racing           the candidates that get no more trials
    known_values     the values of trials that decide
    phases           the candidates requested so far, and their tables
    plan             the largest number of trials that a search would run

Modules that analyse:

    asked_trials     the table of a search, with the trials of it
    trials_by_block  these as arrays by candidate, block and scenario
    block_intervals  estimates from blocks, with confidence intervals
    outcome          the status of candidates, and the choice among them
    fronts           Pareto fronts, hypervolume
    held_out         the chosen, judged on new seeds
    repetitions      the search against random search
    findings         all findings of a report
    sentences        the same in sentences
    report           the same as plain data, tables and text
    points_behind    the stored points of a candidate
    export           a study of optuna
"""
