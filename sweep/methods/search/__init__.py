"""Search: candidates are proposed, raced against each other, and judged on new seeds.

A candidate is a set of values of the searched parameters. A scenario is a point at
which every candidate is evaluated. A block is one replicate in every scenario; block k
has common random numbers for all candidates.

section              `search`, its reader, and its effects on a study
section_keys         the keys of the section
checks               joint requirements of the parts
objectives           objectives and constraints

statistics           statistics of the values of a metric
known_samplers       samplers of candidates
schema               the section in the JSON Schema of a spec

strategy             the search, its repetitions, and the held-out trials of each
run                  one run: ask, race and tell, until the budget is spent

samplers             optuna, which proposes candidates
candidates           from values of parameters to trials; references; seeds
racing               the tests that drop candidates

known_values         the values of trials that decide
phases               the requests so far, and their tables
plan                 the largest number of trials of a search

asked_trials         the stored requests, with their trials
trials_by_block      trials as arrays by candidate, block and scenario

block_intervals      estimates from blocks, with confidence intervals
outcome              the state of candidates, and the chosen candidates
held_out             the chosen candidates, judged on new seeds

repetitions          the search against random search
findings             all contents of a report
sentences            the findings in sentences
report               the findings as plain data, tables and strings

points_behind        the stored points of a candidate
separate_phases      a stored search with separate phases

figure               the history of a search, and its front
figure_kind          the kinds of figures of a search
figure_layout        the layout of history and front, drawn or as marks

figure_marks         history and front as marks
figure_repetitions   the repetitions of a search as figures
exporting            a study of optuna
method               the entry of a search
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
