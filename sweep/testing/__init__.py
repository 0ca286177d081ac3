"""Checks of the promises that models and other entries of a file make.

`sweep check` reports the promises of a file. Tests of an author can require a promise:

    import pytest
    from sweep.testing import PROMISES, assert_keeps, assert_offers

    @pytest.mark.parametrize("promise", PROMISES)
    def test_vortex_keeps(promise):
        assert_keeps("vortex.py", promise)

    def test_my_metrics():
        assert_offers("mine.py")

A broken promise is an AssertionError, which names file, line and rule. A promise that
does not apply is skipped, with the reason.

promises     all promises by name, with outcomes
beforehand   promises that a launch checks for a custom model
subject      the checked model

entrants     the checked metrics, maps, initial conditions and samplers of a file
offered      the promises of metrics, maps, initial conditions and samplers
given        the values of an entry, also from a separate process

described    parameters and presets
compiled     no allocation; results bitwise identical to plain Python
calls        the flock before a step, and the grid after the step
interpreted  the program that runs a model in plain Python
grids        any grid
restarts     from any step
driven       each boid, once in each step
devices      bitwise identical on a GPU

elsewhere    programs in separate processes
processes    one process or two
symmetries   the declared symmetries of a moved flock
reaching     the declared reach of a boid

flights      small trials, and the first difference between two trials
places       file and line of a declaration of a model
mishaps      an error that a model raises, as a sentence
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
