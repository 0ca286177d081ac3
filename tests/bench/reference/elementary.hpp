// Sine, cosine and arctangent with the bits of kernels/elementary.py: the same
// operations in the same order. compiling.py writes the tables.
#pragma once

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "elementary_tables.hpp"
#include "trial.hpp"

namespace elementary {

constexpr double MOST_ANGLE = 0x1p20, SPLITTER = 0x1p27 + 1.0, SHIFT = 0x1.8p52;
constexpr double SINE_PARTS = 64.0, ATAN_PARTS = 128.0, FLAT = 0x1p-60;
constexpr double PER_HALF_PI = 2.0 / std::numbers::pi;
constexpr double EIGHTH = 0.25 * std::numbers::pi;
constexpr double QUARTER = 1.5707963267948966, BEYOND_QUARTER = 6.123233995736766e-17;
constexpr double NO_NUMBER = std::numeric_limits<double>::quiet_NaN();

// A number in two parts: the second is what the first rounds away.
struct Pair {
    double high, low;
};

struct Turn {
    double sine, cosine;
};

inline Pair sum(double a, double b) {
    const double s = a + b, back = s - a;
    return {s, (a - (s - back)) + (b - back)};
}

// The sum where |a| >= |b|, or a is 0.
inline Pair sum_to(double a, double b) {
    const double s = a + b;
    return {s, b - (s - a)};
}

inline Pair halves(double a) {
    const double c = SPLITTER * a, high = c - (c - a);
    return {high, a - high};
}

inline Pair product(double a, double b) {
    const double p = a * b;
    const auto [c, d] = halves(a);
    const auto [e, f] = halves(b);
    return {p, ((c * e - p) + c * f + d * e) + d * f};
}

// The last bits of a number that is shifted to the whole ones.
inline i64 last_bits(double shifted, i64 mask) {
    return std::bit_cast<i64>(shifted) & mask;
}

// Of high + low, an angle of at most pi / 4 to either side.
inline Turn near_zero(double high, double low) {
    const double size = std::abs(high);
    const i64 k = last_bits(std::min(EIGHTH, size) * SINE_PARTS + SHIFT, 63);
    const auto [d, rest] = sum(size - double(k) / SINE_PARTS, high >= 0.0 ? low : -low);
    const double square = d * d;
    const double cubed =
        d * square * (-1.0 / 6 + square * (1.0 / 120 - square * (1.0 / 5040)));
    const double fallen =
        square * (-0.5 + square * (1.0 / 24 - square * (1.0 / 720)));
    const double s = SINE_HIGH[k], s_low = SINE_LOW[k];
    const double c = COSINE_HIGH[k], c_low = COSINE_LOW[k];
    const auto [a, b] = product(c, d);
    const auto [y, f] = sum_to(s, a);
    const double sine =
        y + (f + (b + (s_low + c_low * d + c * rest + (s * fallen + c * cubed))));
    const auto [p, q] = product(s, d);
    const auto [z, g] = sum_to(c, -p);
    const double part = c * fallen - s * cubed;
    const double cosine = z + (g + (part + (c_low - q - s_low * d - s * rest)));
    return {high >= 0.0 ? sine : -sine, cosine};
}

inline Turn sine_cosine(double x) {
    if (!(std::abs(x) <= MOST_ANGLE)) return {NO_NUMBER, NO_NUMBER};
    const double shifted = x * PER_HALF_PI + SHIFT, quarters = shifted - SHIFT;
    const double a = x - quarters * HALF_PI[0], b = quarters * HALF_PI[1];
    const Pair first = sum(a, -b);
    const Pair second = sum(first.low, -(quarters * HALF_PI[2]));
    const Pair third = sum(first.high, second.high);
    const Pair left =
        sum_to(third.high, third.low + (second.low - quarters * HALF_PI[3]));
    auto [s, c] = near_zero(left.high, left.low);
    const i64 quarter = last_bits(shifted, 3);
    if (quarter & 1) s = std::exchange(c, -s);
    if (quarter & 2) s = -s, c = -c;
    return {x == 0.0 ? x : s, c};
}

// The arctangent of small / big; small <= big, both finite and not below 0.
inline Pair slope(double small, double big) {
    const double ratio = small > 0.0 ? small / big : 0.0;
    if (ratio < FLAT) return {ratio, 0.0};
    // Both are scaled by the power of 2 that takes the larger one to [1/2, 1).
    const __m128d whole = _mm_set_sd(big), exponent = _mm_getexp_sd(whole, whole);
    const double x = _mm_cvtsd_f64(
        _mm_getmant_sd(whole, whole, _MM_MANT_NORM_p5_1, _MM_MANT_SIGN_src));
    const double y = _mm_cvtsd_f64(_mm_scalef_sd(
        _mm_set_sd(small), _mm_sub_sd(_mm_set_sd(-1.0), exponent)));
    const i64 k = last_bits(std::min(1.0, ratio) * ATAN_PARTS + SHIFT, 255);
    const double a = double(k) / ATAN_PARTS;
    const Pair p = product(a, x);
    const Pair difference = sum(y, -p.high);
    const auto [over, low] = sum(difference.high, difference.low - p.low);
    const Pair q = product(a, y);
    const auto [under, rest] = sum_to(x, q.high);
    const double t = over / under;
    const auto [r, lost] = product(t, under);
    const double left = (((over - r) - lost) + low - t * (rest + q.low)) / under;
    const double square = t * t;
    const double cubed =
        -1.0 / 3 + square * (1.0 / 5 - square * (1.0 / 7 - square * (1.0 / 9)));
    const auto [high, kept] = sum_to(ATAN_HIGH[k], t);
    return sum_to(high, kept + (ATAN_LOW[k] + left + t * square * cubed));
}

inline double atan2(double y, double x) {
    if (x != x || y != y) return NO_NUMBER;
    const double across = std::abs(y), along = std::abs(x);
    const bool steep = across > along, back = std::signbit(x);
    double small = steep ? along : across, big = steep ? across : along;
    if (std::isinf(big)) {  // two infinite numbers are equal, and others are nothing
        small = small == big ? 1.0 : 0.0;
        big = 1.0;
    }
    const auto [high, low] = slope(small, big);
    double angle = high + low;
    if (back || steep) {
        const double turns = steep ? 1.0 : 2.0, sign = steep && back ? 1.0 : -1.0;
        const auto [a, b] = sum(turns * QUARTER, sign * high);
        angle = a + (b + (turns * BEYOND_QUARTER + sign * low));
    }
    return std::copysign(angle, y);
}

}  // namespace elementary
