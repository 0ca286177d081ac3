"""Physics of the simulation: flocks, rules, worlds and metrics as numba kernels.

Kernels read no file, print nothing and validate nothing.

    settings     parameters and settings of a study, each described once
    model        declaration of a model
    models/      one file per published model
    metrics/     recorded frames -> numbers
    flight       one running trial, from the initial condition to the metrics
    inspection   observation of a running trial, without a change of the trial
    layers       optional layers of a trial, and models compiled for the layers
    registry     built-in entries and entries of installed packages, by name
    catalogue    the entries that specs name
    identity     the code that computes the results of a trial
    stamps       hashes of the code of a function and of all definitions it uses
    jit          compilation of kernels
    caching      storage of compiled kernels
    goals        several goals in turn
    lanes/       vectorised kernels: eight trials at once (SIMD)
    state        Flock, World: the inputs of kernels
    workspace    further inputs of a model: grids, states and layers
    fours        four numbers side by side
    indices      unsigned indices, and marks that are read 64 at a time
    near         storage for the neighbours of one boid
    neighbours   neighbour search by range and field of view
    topology     choice of neighbours among the perceived boids
    torus        distances with periodic boundaries
    fetching     memory requests ahead of use
    chance       random numbers by address: a hash of a key and of the purpose
    arbitration  combination of forces into one acceleration
    angles       cosine and sine from arithmetic alone, for angles up to half a turn
    elementary   elementary functions from arithmetic alone
    elementary_tables  tables of the elementary functions
    device/      trials on a GPU, one per thread
    generator    random numbers of NumPy's generator where NumPy is missing
    rules/       social, steering, headings, avoidance, obstacles, borders
    robots/      sensing, actuation, failures and wind
    shapes       shapes of obstacles
    polygons     obstacles of any shape: nearest points, inside tests, occlusion
    moving       obstacles that move
    worlds       maps -> World
    arenas       maps for small robots, in metres
    occupancy    grids on which a model looks for obstacles
    starts       initial conditions
    recording    frames of a trial
    events       counts of events during a trial
    groups       connected components of positions
    coverage     visited pixels
"""

INTERFACE = 1
"""Version of the interface that custom models import; see docs/own-models.md."""
