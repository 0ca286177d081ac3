"""Specs for the tests: the examples that must load, and a short one to vary."""

from sweep.spec.study import Study, parse_spec

SEPARATION = """\
study: nguyen2024/separation     # results/nguyen2024/separation
model: nguyen2024
preset: as_run
fixed: {n: 200, steps: 500}
sweep:
  separation_weight: [0.5, 0.75, 1, 1.5, 2]
replicates: 100                  # or seeds: [27, 729, 4913]
seed: 2024
record:
  series: [speed, flock_radius, turn_rate_unwrapped, dispersion]   # per frame
  every: 1
"""

GAINS = """\
study: aziel_chen2025/gains
model: aziel_chen2025
preset: as_run
fixed: {steps: 3600}
sweep:
  map: [dense_cafeteria, cafeteria, narrow_corridor, empty]
  n: [50, 100]
  gains:                         # one joint axis: 2000 points of three parameters
    sample: random               # random | lhs | sobol | halton | table
    points: 2000
    cohesion_weight: {uniform: [0, 0.5]}
    alignment_weight: {uniform: [0, 0.1]}
    separation_weight: {uniform: [0, 0.5]}
seeds: [27, 729, 4913]
seed: 4913
"""

SHORT = """\
study: short
model: nguyen2024
preset: as_run
replicates: 2
seed: 1
"""

EVERYTHING = """\
study: every/thing-1.0
model: aziel_chen2025
preset: as_written
fixed: {obstacle_range: .inf, update: sequential, n: 10, minimum_image: false}
sweep:
  map: [empty, cafeteria]
  fov: {linspace: [90, 360, 4]}
  perception_range: {logspace: [10, 1000, 3], when: "map == 'empty'"}
  goal_weight: {values: [0, 1], when: "fov > 100"}
  max_speed: {normal: [5, 1], points: 2}
  priority: {choice: [obstacle_first, separation_first], points: 4}
  gains:
    sample: sobol
    points: 2
    when: fov < 100
    cohesion_weight: {loguniform: [0.01, 1]}
    alignment_weight: {uniform: [0, 1]}
  sizes:
    zip: {steps: [10, 20], separation_range: {linspace: [1, 2, 2]}}
derive:
  separation_weight: 2 * cohesion_weight
require: ["separation_range < perception_range"]
seeds: [1, 2]
seed: 3
streams: {start: independent, noise: common}
record: {metrics: [coverage], series: [speed], every: 10, heatmaps: true}
time_limit: 60
"""


def short(*lines: str) -> str:
    """The short spec with more lines, the first of which is line 6."""
    return SHORT + "".join(f"{line}\n" for line in lines)


def short_study(*lines: str) -> Study:
    """The study of `short`."""
    return parse_spec(short(*lines))
