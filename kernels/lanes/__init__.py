"""Eight trials at once, one in each lane of the processor's vectors.

together     trials that are advanced together, and observed one by one kernel       a
model's `advance` for eight trials conversion   functions for lanes, from the text that
they have for one trial expressions  the expressions of such a text facts        types
of its names, and which of them differ from lane to lane syntax       pieces of Python's
syntax trees calls        properties of our functions, together with those that they
call stubs        functions that numba calls, compiled for the types of a call vectors
numbers of eight trials, as numba types rows         memory of these numbers search
the search for neighbours marks        visits on narrow maps
"""
