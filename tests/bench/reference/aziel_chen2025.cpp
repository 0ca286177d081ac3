// aziel_chen2025 as its authors ran it: sequential, in an open world.
#include <numbers>

#include "cells.hpp"
#include "elementary.hpp"
#include "flight.hpp"

namespace {

// From so many boids on, lists of cells are faster than a look at everyone.
constexpr i64 LARGE_FLOCK = 400;

class AzielChen2025 final : public Flight {
public:
    struct Settings {
        double separation_weight, alignment_weight, cohesion_weight, obstacle_weight;
        double wall_weight, goal_weight, perception_range, fov, separation_range;
        double obstacle_range, epsilon, max_acceleration, max_speed, priority;
        double walls_are_obstacles, range_inclusive, update, dt;
    };

    explicit AzielChen2025(const Trial& trial)
        : Flight(trial),
          s(settings_of<Settings>(trial)),
          obstacles(trial.world, s.obstacle_range),
          share(trial.n + 1) {
        const double half = 0.5 * s.fov * (std::numbers::pi / 180.0);
        const double cosine = elementary::sine_cosine(half).cosine;
        view = cosine * std::abs(cosine);
        for (i64 k = 1; k <= trial.n; ++k) share[k] = 1.0 / double(k);
        if (trial.n >= LARGE_FLOCK)
            cells = std::make_unique<Cells>(trial, flock, s.perception_range);
    }

private:
    struct Sums {
        __m256d all = _mm256_setzero_pd(), crowd = _mm256_setzero_pd();
        i64 found = 0;
    };

    void advance() override {
        for (i64 i = 0; i < flock.n; ++i) {
            const double x = flock.row(i)[0], y = flock.row(i)[1];
            const double vx = flock.row(i)[2], vy = flock.row(i)[3];
            const Sums sums = cells ? search_cells(i) : search_everyone(i);
            double ax, ay;
            accelerate(x, y, vx, vy, sums, ax, ay);
            double new_vx = vx + ax * s.dt, new_vy = vy + ay * s.dt;
            limit(new_vx, new_vy, s.max_speed);
            const double new_x = x + new_vx * s.dt, new_y = y + new_vy * s.dt;
            flock.set(i, new_x, new_y, new_vx, new_vy);
            if (cells) cells->move(i, new_x, new_y);
        }
    }

    // Whom boid i sees of eight, and which of these are `close`.
    struct Eye {
        __m512d x, y, ahead_x, ahead_y, bound;
        double range2, crowd2;

        __mmask8 look(__m512d to_x, __m512d to_y, __mmask8& close) const {
            const __m512d dx = _mm512_sub_pd(to_x, x), dy = _mm512_sub_pd(to_y, y);
            const __m512d distance2 = square_distance(dx, dy);
            const __m512d along =
                _mm512_add_pd(_mm512_mul_pd(dx, ahead_x), _mm512_mul_pd(dy, ahead_y));
            close = is_below(distance2, crowd2);
            return _mm512_mask_cmp_pd_mask(is_below(distance2, range2),
                                           _mm512_mul_pd(along, _mm512_abs_pd(along)),
                                           _mm512_mul_pd(bound, distance2), _CMP_GE_OQ);
        }
    };

    Eye eye_of(i64 i) const {
        const double vx = flock.row(i)[2], vy = flock.row(i)[3];
        return {_mm512_set1_pd(flock.row(i)[0]),
                _mm512_set1_pd(flock.row(i)[1]),
                _mm512_set1_pd(vx),
                _mm512_set1_pd(vy),
                _mm512_set1_pd(view * (vx * vx + vy * vy)),
                s.perception_range * s.perception_range,
                s.separation_range * s.separation_range};
    }

    void add(Sums& sums, __m256d here, i64 j, bool close) const {
        alignas(32) static constexpr double WHETHER[2][4] = {{0, 0, 0, 0},
                                                             {1, 1, 1, 1}};
        const __m256d seen = seen_from(here, flock, j);
        const __m256d counts = _mm256_load_pd(WHETHER[close]);
        sums.all = _mm256_add_pd(sums.all, seen);
        sums.crowd = _mm256_add_pd(sums.crowd, _mm256_mul_pd(seen, counts));
    }

    Sums search_everyone(i64 i) const {
        const Eye eye = eye_of(i);
        const __m256d here = _mm256_set_pd(0, 0, flock.row(i)[1], flock.row(i)[0]);
        Sums sums;
        search<2>(
            flock, i,
            [&](i64, __m512d x, __m512d y, __mmask8* found) {
                found[0] = eye.look(x, y, found[1]);
            },
            [&](i64 first, const u64* words) {
                sums.found += std::popcount(words[0]);
                each(words[0],
                     [&](int k) { add(sums, here, first + k, words[1] >> k & 1); });
            });
        return sums;
    }

    Sums search_cells(i64 i) const {
        const Eye eye = eye_of(i);
        const __m256d here = _mm256_set_pd(0, 0, flock.row(i)[1], flock.row(i)[0]);
        const __m512d away = _mm512_set1_pd(FAR_AWAY);
        const i64 cell = cells->cell(i), length = cells->length(cell);
        const u32* list = cells->list(cell);
        Sums sums;
        for (i64 k = 0; k < length; k += 8) {
            const __m256i boids =
                _mm256_loadu_si256(reinterpret_cast<const __m256i*>(list + k));
            __mmask8 others = k + 8 <= length ? 255 : (1 << (length - k)) - 1;
            others &= _mm256_cmpneq_epi32_mask(boids, _mm256_set1_epi32(int(i)));
            __mmask8 close;
            const __mmask8 near = eye.look(
                _mm512_mask_i32gather_pd(away, others, boids, flock.x.get(), 8),
                _mm512_mask_i32gather_pd(away, others, boids, flock.y.get(), 8), close);
            sums.found += std::popcount(u32(near));
            each(near, [&](int q) { add(sums, here, list[k + q], close >> q & 1); });
        }
        return sums;
    }

    void accelerate(double x, double y, double vx, double vy, const Sums& sums,
                    double& ax, double& ay) const {
        double force_x[5], force_y[5];
        force_x[0] = -s.separation_weight * sums.crowd[0];
        force_y[0] = -s.separation_weight * sums.crowd[1];
        obstacles.repel(x, y, force_x[1], force_y[1], [&](__m512d distance) {
            const __m512d more = _mm512_add_pd(distance, _mm512_set1_pd(s.epsilon));
            return one_over(_mm512_mul_pd(distance, more));
        });
        force_x[1] = s.obstacle_weight * force_x[1];
        force_y[1] = s.obstacle_weight * force_y[1];
        const double width = trial.world.width, height = trial.world.height;
        const __m256d wall =
            _mm256_div_pd(_mm256_set1_pd(1.0),
                          _mm256_add_pd(_mm256_set_pd(height - y, y, width - x, x),
                                        _mm256_set1_pd(s.epsilon)));
        force_x[2] = s.wall_weight * (wall[0] - wall[1]);
        force_y[2] = s.wall_weight * (wall[2] - wall[3]);
        const double part = share[sums.found];
        const double alignment = sums.found ? s.alignment_weight : 0.0;
        const double cohesion = sums.found ? s.cohesion_weight : 0.0;
        force_x[3] = alignment * (sums.all[2] * part - vx);
        force_y[3] = alignment * (sums.all[3] * part - vy);
        force_x[4] = cohesion * (sums.all[0] * part);
        force_y[4] = cohesion * (sums.all[1] * part);
        serve(force_x, force_y, ax, ay);
    }

    // The forces in turn, while their lengths fit in the budget. At most one is cut, so
    // there is one division.
    void serve(const double* force_x, const double* force_y, double& ax,
               double& ay) const {
        const __m512d x = _mm512_maskz_loadu_pd(31, force_x);
        const __m512d y = _mm512_maskz_loadu_pd(31, force_y);
        const __m512d lengths = _mm512_sqrt_pd(square_distance(x, y));
        double left = s.max_acceleration, over = 1.0, below = 1.0, whole[5];
        bool cut[5];
        for (int k = 0; k < 5; ++k) {
            const double length = lengths[k], rest = left - length;
            const bool exceeds = rest < 0;
            cut[k] = exceeds & (left > 0);
            over = cut[k] ? left : over;
            below = cut[k] ? length : below;
            whole[k] = exceeds ? 0.0 : 1.0;
            left = rest > 0 ? rest : 0.0;
        }
        const double ratio = over / below;
        ax = ay = 0.0;
        for (int k = 0; k < 5; ++k) {
            const double scale = cut[k] ? ratio : whole[k];
            ax += force_x[k] * scale;
            ay += force_y[k] * scale;
        }
    }

    Settings s;
    double view;
    Obstacles obstacles;
    std::vector<double> share;
    std::unique_ptr<Cells> cells;
};

}  // namespace

extern "C" Flight* aziel_chen2025(const Trial* trial) {
    return begin<AzielChen2025>(trial);
}
