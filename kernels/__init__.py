"""Physics of the simulation: flocks, rules, worlds and metrics as numba kernels.

Kernels read no file, print nothing and validate nothing.

    settings     parameters and settings of a study, each described once
    model        declaration of a model
    models/      one file per published model
    metrics/     recorded frames -> numbers
    flight       one trial under way, from its start to its numbers
    inspection   what a trial under way shows
    layers       which layers a trial may have, and what is compiled for them
    registry     entries by name, built-in and of installed packages
    catalogue    the entries that names in specs stand for
    identity     the code that the numbers of a trial come from
    stamps       the code of a function and of all that it uses, as a hash
    jit          how kernels are compiled
    caching      where compiled kernels are kept
    goals        several goals in turn
    lanes/       kernels for eight trials at once (SIMD)
    state        Flock, World: the values that enter kernels
    workspace    all that a model works with besides flock, world and parameters
    fours        four numbers side by side
    indices      unsigned indices, and marks read a word at a time
    near         storage for the neighbours of one boid
    neighbours   search of neighbours by range and field of view
    topology     choice of neighbours among the boids in sight
    torus        distances on a torus
    fetching     memory that is prefetched
    chance       random numbers by address: a hash of a key and of their purpose
    arbitration  how forces share one acceleration
    angles       cosine and sine by arithmetic alone, for angles up to half a turn
    elementary   all such functions by arithmetic alone, rounded to the nearest number
    elementary_tables  the numbers that these functions look up
    device/      trials advanced on a GPU, one per thread
    generator    random numbers of NumPy in integers, where there is no NumPy
    rules/       social, steering, headings, avoidance, obstacles, borders
    robots/      sensing, actuation, failures and wind: boids as robots
    shapes       shapes of obstacles
    polygons     obstacles of any shape: nearest points, insides, what is behind them
    moving       obstacles that move
    worlds       maps -> World
    arenas       maps for small robots, in metres
    occupancy    grids on which robots look for obstacles
    starts       initial flocks
    recording    frames of a trial
    events       events that are counted during a trial
    groups       connected components of positions
    coverage     visited pixels
"""

INTERFACE = 1
"""Version of the interface that custom models import; see docs/own-models.md."""
