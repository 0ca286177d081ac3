"""How often a word on a conclusion is wrong: `python -m tests.methods.measured_validity
[STUDIES]` prints the table of docs/decisions/a-conclusion-is-a-sign.md.
"""

import sys
from collections.abc import Iterator, Sequence

import numpy as np

from sweep.analysis import independent_contrast
from sweep.methods.comparison import Inference, judge
from sweep.methods.robustness import OPEN, SURVIVES, TURNS, outcome_of

TRIALS = 12
METHOD = Inference(0.95, "bonferroni")


def said_of(effects: Sequence[float], studies: int) -> list[list[str]]:
    """Of so many made-up studies, in which a difference has these sizes, in standard
    deviations of a trial, in the study first and then in each variant: what is said of
    each variant.
    """
    said = []
    for seed in range(studies):
        rng = np.random.default_rng([11, seed])
        contrasts = [
            independent_contrast(
                rng.normal(0.0, 1.0, TRIALS), rng.normal(size, 1.0, TRIALS)
            )
            for size in effects
        ]
        own, *others = judge(contrasts, METHOD)["verdict"]
        said.append([outcome_of(own, other) for other in others])
    return said


def wrong_words(effect: float, studies: int) -> int:
    """In how many studies any word is wrong, where one variant leaves a difference of
    this size and one turns it; without an effect every word but "not decided" is.
    """
    wrong = [{TURNS}, {SURVIVES}] if effect else [{SURVIVES, TURNS}] * 2
    words = said_of([effect, effect, -effect], studies)
    return sum(any(map(set.__contains__, wrong, row)) for row in words)


def rows(studies: int) -> Iterator[str]:
    yield "effect  wrong (%)  not decided (%)"
    for effect in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0):
        wrong = wrong_words(effect, studies) / studies
        words = said_of([effect, effect, -effect], studies)
        left = np.mean([word == OPEN for row in words for word in row])
        yield f"{effect:6g}  {100 * wrong:9.2f}  {100 * left:15.1f}"


if __name__ == "__main__":
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else 1000):
        print(row, flush=True)
