"""Vectorised (SIMD) batches: eight trials, one per lane of the processor's vectors.

together     trials that are advanced together, and observed in sequence
kernel       the `advance` of a model, for eight trials
conversion   functions for lanes, from the source of functions for one trial
expressions  conversion of expressions
facts        types of names, and differences from lane to lane
syntax       pieces of Python's syntax trees
calls        properties of compiled functions, including the functions called
texts        functions from texts
stubs        functions that numba calls, compiled for the types of a call
vectors      numbers of eight trials, as numba types
rows         memory of the numbers of eight trials
search       the search for neighbours
marks        visits on narrow maps
"""
