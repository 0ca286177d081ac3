// A flock, and the search for neighbours among everyone, eight boids at a time.
#pragma once

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "trial.hpp"

#if !defined(__AVX512F__) || !defined(__AVX512VL__) || !defined(__AVX512DQ__)
#error "the reference needs a processor with AVX-512"
#endif

constexpr double TINY = 1e-300;
constexpr double FAR_AWAY = 1e200;

struct Release {
    void operator()(void* room) const { std::free(room); }
};

// Room for `size` numbers, aligned to 64 bytes.
using Numbers = std::unique_ptr<double[], Release>;

inline Numbers room_for(i64 size, double value) {
    const std::size_t bytes = (size * sizeof(double) + 63) / 64 * 64;
    Numbers room(static_cast<double*>(std::aligned_alloc(64, bytes)));
    std::fill_n(room.get(), bytes / sizeof(double), value);
    return room;
}

// Columns x and y are searched, rows (x, y, vx, vy) are summed. Columns end with places
// that are far away from everyone.
struct Flock {
    i64 n, blocks;
    Numbers x, y, rows;

    explicit Flock(const Trial& trial)
        : n(trial.n),
          blocks((n + 7) / 8),
          x(room_for(8 * blocks, FAR_AWAY)),
          y(room_for(8 * blocks, FAR_AWAY)),
          rows(room_for(32 * blocks, 0.0)) {
        for (i64 i = 0; i < n; ++i)
            set(i, trial.x[i], trial.y[i], trial.vx[i], trial.vy[i]);
    }

    const double* row(i64 i) const { return rows.get() + 4 * i; }

    void set(i64 i, double to_x, double to_y, double vx, double vy) {
        x[i] = to_x;
        y[i] = to_y;
        _mm256_store_pd(rows.get() + 4 * i, _mm256_set_pd(vy, vx, to_y, to_x));
    }

    bool is_finite() const {
        __mmask8 lost = 0;
        for (i64 k = 0; k < 32 * blocks; k += 8) {
            const __m512d values = _mm512_load_pd(rows.get() + k);
            lost |= _mm512_cmp_pd_mask(_mm512_sub_pd(values, values),
                                       _mm512_setzero_pd(), _CMP_NEQ_UQ);
        }
        return lost == 0;
    }

    void write(const Trial& trial) const {
        for (i64 i = 0; i < n; ++i) {
            trial.x[i] = row(i)[0];
            trial.y[i] = row(i)[1];
            trial.vx[i] = row(i)[2];
            trial.vy[i] = row(i)[3];
        }
    }
};

// The displacement to boid j in the first two places, its velocity in the others, if
// `here` is (x, y, 0, 0).
inline __m256d seen_from(__m256d here, const Flock& flock, i64 j) {
    return _mm256_sub_pd(_mm256_load_pd(flock.row(j)), here);
}

// Calls `take(first, words)` for every 64 boids: bit k of words[r] says that boid first
// + k is in range r. `look(first, x, y, found)` says it of eight. Boid i is left out.
template <int RANGES, class Look, class Take>
inline void search(const Flock& flock, i64 i, Look look, Take take) {
    for (i64 from = 0; from < flock.blocks; from += 8) {
        const i64 to = std::min(from + 8, flock.blocks);
        u64 words[RANGES] = {};
        for (i64 block = from; block < to; ++block) {
            __mmask8 found[RANGES];
            look(8 * block, _mm512_load_pd(flock.x.get() + 8 * block),
                 _mm512_load_pd(flock.y.get() + 8 * block), found);
            for (int r = 0; r < RANGES; ++r)
                words[r] |= u64(found[r]) << (8 * (block - from));
        }
        if (i / 64 == from / 8)
            for (u64& word : words) word &= ~(u64(1) << (i & 63));
        take(8 * from, words);
    }
}

// Calls `act(k)` for every bit k of a word, in ascending order.
template <class Act>
inline void each(u64 word, Act act) {
    for (; word != 0; word &= word - 1) act(std::countr_zero(word));
}

inline __m512d square_distance(__m512d dx, __m512d dy) {
    return _mm512_add_pd(_mm512_mul_pd(dx, dx), _mm512_mul_pd(dy, dy));
}

inline __mmask8 is_below(__m512d values, double bound) {
    return _mm512_cmp_pd_mask(values, _mm512_set1_pd(bound), _CMP_LT_OQ);
}

// The lesser of two numbers. What compilers make of std::min is a branch, which the
// processor often mispredicts here.
inline double least_of(double a, double b) {
    return _mm_cvtsd_f64(_mm_min_sd(_mm_set_sd(a), _mm_set_sd(b)));
}

// The vector scaled to length `most` where it is longer.
inline void limit(double& x, double& y, double most) {
    const double length = std::max(std::sqrt(x * x + y * y), TINY);
    const double scale = least_of(most / length, 1.0);
    x *= scale;
    y *= scale;
}

// The velocity scaled to a speed between `least` and `most`; at rest it stays so.
inline void clamp_speed(double& vx, double& vy, double least, double most) {
    const double speed = std::sqrt(vx * vx + vy * vy);
    const double moving = speed > 0.0 ? speed : 1.0;
    double scale = speed > 0.0 && speed < least ? least / moving : 1.0;
    scale = speed > most ? most / moving : scale;
    vx *= scale;
    vy *= scale;
}

// The way back from a border: 1 below `margin`, -1 above length - margin, else 0.
inline double turn_back(double position, double length, double margin) {
    return position < margin ? 1.0 : position > length - margin ? -1.0 : 0.0;
}
