"""Eight trials at once, one in each lane of the processor's vectors.

together     flights that are advanced together, and observed one by one
kernel       a model's `advance` for eight flights
conversion   functions for lanes, from the text that they have for one trial
expressions  the expressions of such a text
facts        what is known of its names, and what differs from lane to lane
syntax       pieces of Python's syntax trees
calls        what functions of ours do, with those that they call
stubs        what numba calls, compiled for the types of a call
vectors      numbers of eight trials, as numba types
rows         where these numbers lie
search       who sees whom
marks        visits on narrow maps
"""
