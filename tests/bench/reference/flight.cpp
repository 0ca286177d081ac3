#include "flight.hpp"

extern "C" int fly(Flight* flight) { return flight->fly(); }
extern "C" void end(Flight* flight) { delete flight; }
