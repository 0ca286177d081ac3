"""Checks of the promises that models and other entries of a file make.

`sweep check` reports them for a file. An author's own tests can require them:

    import pytest
    from sweep.testing import PROMISES, assert_keeps, assert_offers

    @pytest.mark.parametrize("promise", PROMISES)
    def test_vortex_keeps(promise):
        assert_keeps("vortex.py", promise)

    def test_my_metrics():
        assert_offers("mine.py")

A broken promise is an AssertionError, which names file, line and rule. A promise that
does not apply is skipped, with the reason.

promises     all promises by name, and their outcomes
beforehand   those that a launch checks for a custom model
subject      the model that is checked
entrants     the metrics, maps, starts and samplers of a file that are checked
offered      the promises of these
given        their values, also from a program in a process of its own
described    parameters and presets
compiled     no allocation; results bitwise identical to plain Python
calls        the flock before a step, and the grid after it
interpreted  the program that runs a model in plain Python
grids        any grid
restarts     from any step
driven       each boid, once in each step
devices      bitwise identical on a GPU
elsewhere    programs in processes of their own
processes    one process or two
symmetries   the declared symmetries of a moved flock
reaching     the declared reach of a boid
flights      small trials, and the first difference between two
places       file and line of a declaration of a model
mishaps      an error that a model raises, as a sentence
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
