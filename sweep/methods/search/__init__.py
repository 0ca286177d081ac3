"""Search: candidates are proposed, raced against each other, and judged on new seeds.

A candidate is one set of values of the parameters that are searched over. A scenario is
one point of what a candidate must be good at together. A block is one replicate in
every scenario; block k has the same random numbers for every candidate.

section              `search`, its reader, and what a study has through it
section_keys         its keys
checks               the requirements of its parts together
objectives           objectives and constraints
statistics           statistics of the values of a metric
known_samplers       samplers of candidates
schema               the section in the JSON Schema of a spec
strategy             the search, its repetitions, and the held-out trials of each
run                  one run of these: ask, race and tell, until the budget is spent
samplers             optuna, which proposes candidates
candidates           from values of parameters to trials; references; seeds
racing               the tests that drop candidates
known_values         the values of trials that decide
phases               the requests so far, and their tables
plan                 the most that a search would run
asked_trials         the stored requests, with their trials
trials_by_block      trials as arrays by candidate, block and scenario
block_intervals      estimates from blocks, with confidence intervals
outcome              the state of candidates, and the chosen ones
held_out             the chosen candidates, judged on new seeds
repetitions          the search against random search
findings             all that a report says
sentences            the findings in sentences
report               the findings as plain data, tables and text
points_behind        the stored points of a candidate
separate_phases      a stored search with its phases apart
figure               the history of a search, and its front
figure_kind          the kinds of these figures
figure_layout        the layout of both, drawn or as marks
figure_marks         both as marks
figure_repetitions   the repetitions of a search as figures
exporting            a study of optuna
method               the entry of a search
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
