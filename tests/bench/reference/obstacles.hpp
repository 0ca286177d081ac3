// Obstacles that repel, eight at a time, and those that boids run into.
#pragma once

#include <vector>

#include "flock.hpp"

inline i64 reach_cell(const Reach& reach, double x, double y) {
    const double column = x * reach.columns_per_length;
    const double row = y * reach.rows_per_length;
    if (0 <= column && column < double(reach.columns) && 0 <= row &&
        row < double(reach.rows))
        return i64(row) * reach.columns + i64(column);
    return reach.columns * reach.rows;
}

inline bool inside_any(const World& world, double x, double y) {
    const Reach& contact = world.contact;
    const i64 cell = reach_cell(contact, x, y);
    for (i64 k = contact.first[cell]; k < contact.first[cell + 1]; ++k) {
        const i64 m = contact.obstacle[k];
        const double dx = x - world.obstacle_x[m], dy = y - world.obstacle_y[m];
        const double across = world.half_width[m], along = world.half_height[m];
        if (world.is_round[m] ? dx * dx + dy * dy < across * across
                              : std::abs(dx) < across && std::abs(dy) < along)
            return true;
    }
    return false;
}

// Of every cell of a Reach: x, y and bound of eight obstacles after eight.
class Obstacles {
public:
    Obstacles(const World& world, double margin) : reach_(world.reach) {
        for (i64 cell = 0; cell <= reach_.columns * reach_.rows; ++cell) {
            first_.push_back(eights_.size());
            for (i64 k = reach_.first[cell]; k < reach_.first[cell + 1]; k += 8)
                add(world, margin, k, std::min(k + 8, reach_.first[cell + 1]));
        }
        first_.push_back(eights_.size());
    }

    // The sum of displacements from all obstacles within reach, each times its `scale`.
    template <class Scale>
    void repel(double x, double y, double& force_x, double& force_y,
               Scale scale) const {
        force_x = force_y = 0.0;
        const i64 cell = reach_cell(reach_, x, y);
        for (i64 k = first_[cell]; k < first_[cell + 1]; ++k) {
            const Eight& eight = eights_[k];
            const __m512d dx = _mm512_sub_pd(_mm512_set1_pd(x), eight.x);
            const __m512d dy = _mm512_sub_pd(_mm512_set1_pd(y), eight.y);
            const __m512d distance = _mm512_sqrt_pd(square_distance(dx, dy));
            const __mmask8 near = _mm512_cmp_pd_mask(distance, eight.bound, _CMP_LT_OQ);
            if (near == 0) continue;
            const __m512d factor = scale(distance);
            alignas(64) double part_x[8], part_y[8];
            _mm512_store_pd(part_x, _mm512_mul_pd(dx, factor));
            _mm512_store_pd(part_y, _mm512_mul_pd(dy, factor));
            each(near, [&](int q) {
                force_x += part_x[q];
                force_y += part_y[q];
            });
        }
    }

private:
    struct Eight {
        __m512d x, y, bound;
    };

    void add(const World& world, double margin, i64 from, i64 to) {
        alignas(64) double x[8], y[8], bound[8];
        for (i64 k = from; k < from + 8; ++k) {
            const i64 m = k < to ? reach_.obstacle[k] : -1;
            x[k - from] = m < 0 ? FAR_AWAY : world.obstacle_x[m];
            y[k - from] = m < 0 ? FAR_AWAY : world.obstacle_y[m];
            bound[k - from] =
                m < 0 ? -1.0
                      : std::max(world.half_width[m], world.half_height[m]) + margin;
        }
        eights_.push_back(
            {_mm512_load_pd(x), _mm512_load_pd(y), _mm512_load_pd(bound)});
    }

    Reach reach_;
    std::vector<i64> first_;
    std::vector<Eight> eights_;
};

inline __m512d one_over(__m512d below) {
    return _mm512_div_pd(_mm512_set1_pd(1.0),
                         _mm512_max_pd(below, _mm512_set1_pd(TINY)));
}
