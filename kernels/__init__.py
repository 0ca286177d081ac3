"""The physics: flocks, rules, worlds and metrics as numba kernels. Reads no file,
prints nothing, validates nothing.

    settings     what a user can choose
    model        what a model says of itself
    models/      one file a published model
    metrics/     recorded frames -> numbers
    flight       one flock under way, from its start to its numbers
    inspection   what can be seen of a flight
    layers       which layers a flight may have, and what is compiled for them
    registry     entries by name, ours and those of installed packages
    catalogue    what names in specs stand for
    identity     which code the numbers of a trial come from
    stamps       what code computes, as a hash
    jit          how kernels are compiled
    caching      where compiled kernels are kept
    goals        several goals in turn
    lanes/       kernels for eight flights at once
    state        Flock, World: what enters kernels
    workspace    what a model works with
    fours        four numbers side by side
    indices      unsigned indices, and marks read a word at a time
    neighbours   who sees whom
    torus        distances on a torus
    fetching     memory that is asked for before it is needed
    arbitration  how forces share one acceleration
    angles       cosine and sine by arithmetic alone, for angles up to half a turn
    elementary   all such functions by arithmetic alone, rounded to the nearest number
    elementary_tables  what these look up
    device       what models are compiled to on a GPU
    generator    NumPy's random numbers in integers, where there is no NumPy
    rules/       social, steering, headings, avoidance, obstacles, borders
    shapes       what obstacles there can be
    polygons     those of any shape: nearest points, insides, what is behind them
    moving       obstacles that move
    worlds       maps -> World
    arenas       maps for small robots, in metres
    occupancy    grids on which robots look for obstacles
    starts       initial flocks
    recording    frames of a trial
    events       what is counted during a trial
    groups       connected components of places
    coverage     visited pixels
"""

INTERFACE = 1
"""The version of what models of others may import; see docs/own-models.md."""
