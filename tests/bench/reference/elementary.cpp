// The elementary functions one by one, for a comparison with those of Python.
#include "elementary.hpp"

extern "C" double angle(double y, double x) { return elementary::atan2(y, x); }
extern "C" double sine(double x) { return elementary::sine_cosine(x).sine; }
extern "C" double cosine(double x) { return elementary::sine_cosine(x).cosine; }
