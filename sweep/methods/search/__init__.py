"""Searches for good settings: candidates are asked of a sampler, raced against each
other, and judged on new seeds.

A candidate is one set of values of the settings that are searched over. A scenario is
one point of what a candidate must be good at together. A block is one replicate in
every scenario; block k has the same random numbers for every candidate.

What runs:

    strategy         the search, its repetitions, and the held-out trials of each
    run              one run of these: ask, race and tell, until the budget is spent
    samplers         optuna, which proposes candidates
    candidates       from values of settings to trials; references; seeds
    racing           which candidates get no more trials
    known_values     the values of trials that decide
    phases           what is asked for so far, and the tables of it
    plan             what a search would run at most

What it found:

    asked_trials     what was asked for, with the trials of it
    trials_by_block  these as arrays by candidate, block and scenario
    block_intervals  estimates from blocks, with intervals
    outcome          what became of candidates, and which are chosen
    fronts           Pareto fronts, hypervolume
    held_out         the chosen, judged on new seeds
    repetitions      the search against random search
    findings         all that a report says
    sentences        the same in sentences
    report           the same as plain data, tables and text
    points_behind    which stored points stand behind a candidate
    export           a study of optuna
"""
