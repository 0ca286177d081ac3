// rustamani2024 as its authors ran it: synchronous, in an open world, seen all round.
#include <numbers>

#include "elementary.hpp"
#include "flight.hpp"

namespace {

struct Vector {
    double x, y;
};

class Rustamani2024 final : public Flight {
public:
    struct Settings {
        double obstacle_weight, separation_weight, arrival_weight, seek_weight;
        double alignment_weight, cohesion_weight, priority, alignment_gain;
        double navigation_gain, arrival_gain, arrival_limited, stop_distance;
        double slow_distance, leader_share, perception_range, fov, separation_range;
        double range_inclusive, look_ahead, path_step, angle_step, grid_cell, inflation;
        double acceleration_pool, max_acceleration, max_speed, component_limits;
        double update, dt;
    };

    explicit Rustamani2024(const Trial& trial)
        : Flight(trial),
          s(settings_of<Settings>(trial)),
          next(trial),
          leaders(i64(std::floor(s.leader_share * double(trial.n) + 0.5))),
          quotient_x(room_for(8 * flock.blocks, 0.0)),
          quotient_y(room_for(8 * flock.blocks, 0.0)) {
        const i64 points = i64(std::floor(s.look_ahead / s.path_step + 1e-9));
        for (i64 k = 1; k < points; ++k) shares.push_back(double(k) / double(points));
        turns = i64(std::floor(std::numbers::pi / s.angle_step));
    }

private:
    struct Sums {
        __m256d all = _mm256_setzero_pd();
        Vector crowd{0.0, 0.0};
        i64 count = 0;
    };

    void advance() override {
        for (i64 i = 0; i < flock.n; ++i) {
            const double x = flock.row(i)[0], y = flock.row(i)[1];
            const double vx = flock.row(i)[2], vy = flock.row(i)[3];
            const Vector a = acceleration(i, x, y, vx, vy);
            const Vector v = limited({vx + a.x * s.dt, vy + a.y * s.dt}, s.max_speed);
            next.set(i, x + v.x * s.dt, y + v.y * s.dt, v.x, v.y);
        }
        std::swap(flock, next);
    }

    static Vector limited(Vector v, double most) {
        return {std::max(-most, std::min(v.x, most)),
                std::max(-most, std::min(v.y, most))};
    }

    Sums look_about(i64 i) {
        const __m512d x = _mm512_set1_pd(flock.row(i)[0]);
        const __m512d y = _mm512_set1_pd(flock.row(i)[1]);
        const __m256d here = _mm256_set_pd(0, 0, flock.row(i)[1], flock.row(i)[0]);
        Sums sums;
        search<2>(
            flock, i,
            [&](i64 first, __m512d to_x, __m512d to_y, __mmask8* found) {
                const __m512d dx = _mm512_sub_pd(to_x, x), dy = _mm512_sub_pd(to_y, y);
                const __m512d distance2 = square_distance(dx, dy);
                found[0] = is_below(distance2, s.perception_range * s.perception_range);
                const __mmask8 apart =
                    _mm512_cmp_pd_mask(_mm512_setzero_pd(), distance2, _CMP_LT_OQ);
                found[1] = found[0] & apart &
                           is_below(distance2, s.separation_range * s.separation_range);
                if (found[1]) {
                    _mm512_store_pd(quotient_x.get() + first,
                                    _mm512_div_pd(dx, distance2));
                    _mm512_store_pd(quotient_y.get() + first,
                                    _mm512_div_pd(dy, distance2));
                }
            },
            [&](i64 first, const u64* words) {
                sums.count += std::popcount(words[0]);
                each(words[0], [&](int k) {
                    sums.all =
                        _mm256_add_pd(sums.all, seen_from(here, flock, first + k));
                });
                each(words[1], [&](int k) {
                    sums.crowd.x -= quotient_x[first + k];
                    sums.crowd.y -= quotient_y[first + k];
                });
            });
        return sums;
    }

    // The terms in order of priority, safety first, added while there is room.
    Vector acceleration(i64 i, double x, double y, double vx, double vy) {
        const Vector round = avoidance(x, y, vx, vy);
        const Sums sums = look_about(i);
        const Vector crowd = sums.crowd;
        const double length =
            std::max(std::sqrt(crowd.x * crowd.x + crowd.y * crowd.y), TINY);
        const double away = s.separation_weight;
        const double pace = s.alignment_weight * s.alignment_gain,
                     near = s.cohesion_weight;
        const double share = 1.0 / double(sums.count);
        const __m256d none = _mm256_setzero_pd();
        const __m256d mean =
            sums.count ? _mm256_mul_pd(sums.all, _mm256_set1_pd(share)) : none;
        const __m256d own = sums.count ? _mm256_set_pd(vy, vx, 0, 0) : none;
        const __m256d seen = _mm256_sub_pd(mean, own);
        Vector there{0.0, 0.0}, sought{0.0, 0.0};
        if (i < leaders) navigate(x, y, vx, vy, there, sought);
        const Vector terms[6] = {
            {s.obstacle_weight * round.x, s.obstacle_weight * round.y},
            {away * (crowd.x / length), away * (crowd.y / length)},
            there,
            sought,
            {pace * seen[2], pace * seen[3]},
            {near * seen[0], near * seen[1]}};
        const double most2 = s.acceleration_pool * s.acceleration_pool;
        Vector sum{0.0, 0.0};
        for (const Vector& term : terms) {
            sum.x += term.x;
            sum.y += term.y;
            if (!(sum.x * sum.x + sum.y * sum.y <= most2)) break;
        }
        return limited(sum, s.max_acceleration);
    }

    void navigate(double x, double y, double vx, double vy, Vector& there,
                  Vector& sought) const {
        const double dx = trial.world.goal_x - x, dy = trial.world.goal_y - y;
        const double distance = std::sqrt(dx * dx + dy * dy);
        const double scale =
            s.arrival_gain * s.max_speed / std::max(distance, s.slow_distance);
        const double far = distance < s.stop_distance ? 0.0 : 1.0;
        there = {s.arrival_weight * (far * (scale * dx - vx)),
                 s.arrival_weight * (far * (scale * dy - vy))};
        const double gain = s.navigation_gain;
        sought = limited({gain * dx - vx, gain * dy - vy}, s.max_acceleration);
        sought = {s.seek_weight * sought.x, s.seek_weight * sought.y};
    }

    // The unit vector of the free heading nearest to the velocity; zero if the way
    // ahead is free. A dead end is counted.
    Vector avoidance(double x, double y, double vx, double vy) {
        if (vx == 0.0 && vy == 0.0) return {0.0, 0.0};
        const double heading = elementary::atan2(vy, vx);
        if (is_free(x, y, direction(heading))) return {0.0, 0.0};
        for (i64 k = 1; k <= turns; ++k)
            for (const double side : {1.0, -1.0}) {
                const Vector free =
                    direction(heading + side * (double(k) * s.angle_step));
                if (is_free(x, y, free)) return free;
            }
        recorder.event(DEAD_ENDS) += 1;
        return {0.0, 0.0};
    }

    static Vector direction(double heading) {
        const auto [sine, cosine] = elementary::sine_cosine(heading);
        return {cosine, sine};
    }

    bool is_free(double x, double y, Vector ahead) const {
        const double along = s.look_ahead * ahead.x;
        const double across = s.look_ahead * ahead.y;
        for (const double share : shares)
            if (is_taken(x + share * along, y + share * across)) return false;
        return true;
    }

    bool is_taken(double x, double y) const {
        const Occupancy& grid = trial.occupancy;
        const double column = x * grid.per_length, row = y * grid.per_length;
        return !(0.0 <= column && column < double(grid.columns) && 0.0 <= row &&
                 row < double(grid.rows)) ||
               grid.taken[i64(row) * grid.columns + i64(column)];
    }

    Settings s;
    Flock next;
    i64 leaders, turns;
    Numbers quotient_x, quotient_y;
    std::vector<double> shares;
};

}  // namespace

extern "C" Flight* rustamani2024(const Trial* trial) {
    return begin<Rustamani2024>(trial);
}
