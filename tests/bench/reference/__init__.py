"""The built-in models in C++, written by hand for AVX-512, as their authors ran them.
Every number that a trial leaves has the same bits as ours.

trial.hpp      the start of a trial, as binding.py hands it over
flock.hpp      a flock, and the search among everyone, eight boids at a time
cells.hpp      the search of large flocks
obstacles.hpp  obstacles that repel, and those that boids run into
elementary.hpp sine, cosine and arctangent; elementary.cpp is for its test
recorder.hpp   pixels, visits and events
flight.hpp     a trial under way; flight.cpp is the way in
MODEL.cpp      the step of a model
compiling      a library of these files, by each compiler that is there
binding        trials that start as ours do
"""
