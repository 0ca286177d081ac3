// What a trial counts in each step: pixels, visits, and what happens to boids.
#pragma once

#include <cstring>
#include <vector>

#include "obstacles.hpp"

// In the order of kernels/events.py.
enum Event {
    ESCAPES,
    COLLISIONS,
    BOID_COLLISIONS,
    ARRIVED,
    ARRIVAL_STEPS,
    SETTLED,
    DEAD_ENDS,
    PAIR_COLLISIONS,
    FISSIONS,
    FUSIONS,
    GOALS_REACHED
};

class Recorder {
public:
    Recorder(const Trial& trial, const Flock& flock)
        : world_(trial.world),
          record_(trial.record),
          outside_(trial.n),
          inside_(trial.n),
          arrived_(trial.n) {
        if (!record_.counting) return;
        const i64 arrived = event(ARRIVED);
        count_places(flock);
        event(ESCAPES) = event(COLLISIONS) = 0;
        event(ARRIVED) = event(GOALS_REACHED) = arrived;
    }

    // Takes note of one step; returns whether all numbers are finite.
    bool note(const Flock& flock) {
        ++step_;
        if (!flock.is_finite()) return false;
        if (record_.covering == PIXELS) mark_all<false>(flock);
        if (record_.covering == VISITS) mark_all<true>(flock);
        if (record_.counting) count_places(flock);
        return true;
    }

    i64& event(Event which) { return record_.events[which]; }

private:
    static constexpr u8 SHAPE[5] = {4, 14, 31, 14, 4};
    static constexpr u64 BYTES[5] = {0x10000, 0x1010100, 0x101010101, 0x1010100,
                                     0x10000};

    // Sums of a step: pixels that were new, visits, and the visits before of all
    // pixels.
    struct Sums {
        i64 fresh = 0, visits = 0, total = 0;
        __m256i totals = _mm256_setzero_si256();
    };

    template <bool COUNTS>
    void mark_all(const Flock& flock) {
        Sums sums;
        for (i64 i = 0; i < flock.n; ++i) mark<COUNTS>(flock.x[i], flock.y[i], sums);
        alignas(32) u32 parts[8];
        _mm256_store_si256(reinterpret_cast<__m256i*>(parts), sums.totals);
        for (u32 part : parts) sums.total += part;
        record_.sums[0] += sums.fresh;
        record_.sums[1] += sums.visits;
        record_.sums[2] += 2 * sums.total + sums.visits;
    }

    template <bool COUNTS>
    void mark(double x, double y, Sums& sums) {
        const double right = double(record_.columns), top = double(record_.rows);
        if (2.0 <= x && x < right - 3.0 && 2.0 <= y && y < top - 3.0) {
            i64 at = (i64(y) - 2) * record_.columns + i64(x) - 2;
            for (int r = 0; r < 5; ++r, at += record_.columns)
                if constexpr (COUNTS)
                    count_row(record_.visits + at, SHAPE[r], sums);
                else
                    see_row(record_.seen + at, BYTES[r], sums);
        } else if (-3.0 < x && x < right + 2.0 && -3.0 < y && y < top + 2.0) {
            mark_clipped<COUNTS>(i64(x), i64(y), sums);
        }
    }

    static void count_row(i32* visits, __mmask8 shape, Sums& sums) {
        const __m256i nothing = _mm256_setzero_si256();
        const __m256i old = _mm256_maskz_loadu_epi32(shape, visits);
        _mm256_mask_storeu_epi32(visits, shape,
                                 _mm256_add_epi32(old, _mm256_set1_epi32(1)));
        sums.fresh +=
            std::popcount(u32(_mm256_mask_cmpeq_epi32_mask(shape, old, nothing)));
        sums.visits +=
            std::popcount(u32(_mm256_mask_cmpge_epi32_mask(shape, old, nothing)));
        sums.totals = _mm256_add_epi32(sums.totals, _mm256_max_epi32(old, nothing));
    }

    static void see_row(u8* seen, u64 shape, Sums& sums) {
        u64 old;
        std::memcpy(&old, seen, 8);
        sums.fresh += std::popcount(shape & ~old);
        old |= shape;
        std::memcpy(seen, &old, 8);
    }

    template <bool COUNTS>
    void mark_clipped(i64 x, i64 y, Sums& sums) {
        const i64 last_row = std::min(record_.rows - 1, y + 2);
        for (i64 row = std::max<i64>(0, y - 2); row <= last_row; ++row) {
            const i64 half = 2 - std::abs(row - y);
            const i64 last = std::min(record_.columns - 1, x + half);
            for (i64 column = std::max<i64>(0, x - half); column <= last; ++column) {
                const i64 at = row * record_.columns + column;
                if constexpr (COUNTS) {
                    const i64 old = record_.visits[at]++;
                    sums.fresh += old == 0;
                    sums.visits += old >= 0;
                    sums.total += std::max<i64>(old, 0);
                } else {
                    sums.fresh += !record_.seen[at];
                    record_.seen[at] = 1;
                }
            }
        }
    }

    void count_places(const Flock& flock) {
        const double radius2 = world_.goal_radius * world_.goal_radius;
        for (i64 i = 0; i < flock.n; ++i) {
            const double x = flock.x[i], y = flock.y[i];
            const bool outside =
                x < 0 || x > world_.width || y < 0 || y > world_.height;
            const bool inside = inside_any(world_, x, y);
            event(ESCAPES) += outside && !outside_[i];
            event(COLLISIONS) += inside && !inside_[i];
            outside_[i] = outside;
            inside_[i] = inside;
            const double dx = x - world_.goal_x, dy = y - world_.goal_y;
            if (!arrived_[i] && dx * dx + dy * dy < radius2) {
                arrived_[i] = true;
                event(ARRIVED) += 1;
                event(ARRIVAL_STEPS) += step_;
                event(GOALS_REACHED) += 1;
            }
        }
    }

    World world_;
    Record record_;
    i64 step_ = 0;
    std::vector<u8> outside_, inside_, arrived_;
};
