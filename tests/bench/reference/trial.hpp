// The start of a trial, as Python hands it over. binding.py has classes of the same
// names and fields.
#pragma once

#include <cstdint>

using i32 = std::int32_t;
using i64 = std::int64_t;
using u8 = std::uint8_t;
using u32 = std::uint32_t;
using u64 = std::uint64_t;

// Which obstacles act at a place: see Reach in kernels/worlds.py.
struct Reach {
    i64 columns, rows;
    double columns_per_length, rows_per_length;
    const i64 *first, *obstacle;
};

struct World {
    double width, height, goal_x, goal_y, goal_radius;
    const double *obstacle_x, *obstacle_y, *half_width, *half_height;
    const u8* is_round;
    Reach contact, reach;
};

// Which cells of the world are near an obstacle, row after row.
struct Occupancy {
    i64 rows, columns;
    double per_length;
    const u8* taken;
};

enum Covering : i64 { NOTHING, PIXELS, VISITS };

// `visits` are negative in obstacles, `seen` is 1 there; behind both is room for 64
// more. `sums` has three numbers, `events` eleven, as in kernels/coverage.py and
// events.py.
struct Record {
    i64 covering, counting, rows, columns;
    i32* visits;
    u8* seen;
    i64 *sums, *events;
};

// `settings` are those of the model, in the order of its Params in Python. `random` is
// the state of a PCG64 and its increment, high words first.
struct Trial {
    i64 n, steps;
    double *x, *y, *vx, *vy;
    i64 number_of_settings;
    const double* settings;
    const u64* random;
    World world;
    Occupancy occupancy;
    Record record;
};
