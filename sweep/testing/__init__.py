"""Whether a model keeps the promises that the published ones keep, and what else a file
offers its own; `sweep check` tells, and the tests of an author's own:

    import pytest
    from sweep.testing import PROMISES, assert_keeps, assert_offers

    @pytest.mark.parametrize("promise", PROMISES)
    def test_vortex_keeps(promise):
        assert_keeps("vortex.py", promise)

    def test_my_metrics():
        assert_offers("mine.py")

A broken promise is an AssertionError, which names file, line and rule; a promise that
does not apply is skipped, with the reason.

promises     all of them by name, and what becomes of them
beforehand   those that a launch tries of a model that is not built in
subject      the model that is checked
entrants     the metrics, maps, starts and samplers of a file that are checked
offered      what these promise
given        what they give; the program that asks for it elsewhere
described    settings and presets
compiled     no allocation; the bits of plain Python
calls        the flock before a step, and the grid after it
interpreted  the program that flies in plain Python
grids        any grid
restarts     from any step
driven       each boid, once in each step
devices      the same bits on a GPU
elsewhere    programs in processes of their own
processes    one process or two
symmetries   what is declared of a moved flock
reaching     what is declared of a boid's reach
flights      small flights, and how two differ
places       file and line of what a model says
mishaps      what a model raises, as a sentence
"""

from sweep.testing.promises import PROMISES as PROMISES
from sweep.testing.promises import assert_keeps as assert_keeps
from sweep.testing.promises import assert_offers as assert_offers
