// patel2023 as its author ran it: sequential, in an open world.
#include "flight.hpp"

namespace {

// Where the border rule adds the velocity to itself.
constexpr double ALWAYS = 0, IN_MARGIN = 1;

class Patel2023 final : public Flight {
public:
    struct Settings {
        double separation_weight, alignment_weight, cohesion_weight, obstacle_weight;
        double separation_range, alignment_range, cohesion_range, obstacle_range;
        double border_margin, border_turn, border_adds_velocity, min_speed, max_speed;
        double range_inclusive, update, dt;
    };

    explicit Patel2023(const Trial& trial)
        : Flight(trial),
          s(settings_of<Settings>(trial)),
          obstacles(trial.world, s.obstacle_range) {}

private:
    struct Sums {
        __m256d all = _mm256_setzero_pd(), crowd = _mm256_setzero_pd();
        i64 together = 0, aligned = 0;
    };

    void advance() override {
        for (i64 i = 0; i < flock.n; ++i) {
            double vx = flock.row(i)[2], vy = flock.row(i)[3];
            clamp_speed(vx, vy, s.min_speed, s.max_speed);
            const double x = flock.row(i)[0] + vx * s.dt;
            const double y = flock.row(i)[1] + vy * s.dt;
            steer(x, y, look_about(i, x, y), vx, vy);
            flock.set(i, x, y, vx, vy);
        }
    }

    Sums look_about(i64 i, double x, double y) const {
        alignas(32) static constexpr double COUNTS[2][4] = {{1, 1, 0, 0}, {1, 1, 1, 1}};
        const __m512d from_x = _mm512_set1_pd(x), from_y = _mm512_set1_pd(y);
        const __m256d here = _mm256_set_pd(0, 0, y, x);
        Sums sums;
        search<3>(
            flock, i,
            [&](i64, __m512d to_x, __m512d to_y, __mmask8* found) {
                const __m512d distance2 = square_distance(_mm512_sub_pd(to_x, from_x),
                                                          _mm512_sub_pd(to_y, from_y));
                found[0] = is_below(distance2, s.cohesion_range * s.cohesion_range);
                found[1] = is_below(distance2, s.alignment_range * s.alignment_range);
                found[2] = is_below(distance2, s.separation_range * s.separation_range);
            },
            [&](i64 first, const u64* words) {
                sums.together += std::popcount(words[0]);
                sums.aligned += std::popcount(words[1]);
                each(words[0], [&](int k) {
                    const __m256d counts = _mm256_load_pd(COUNTS[words[1] >> k & 1]);
                    const __m256d seen = seen_from(here, flock, first + k);
                    sums.all = _mm256_add_pd(sums.all, _mm256_mul_pd(seen, counts));
                });
                each(words[2], [&](int k) {
                    sums.crowd =
                        _mm256_sub_pd(sums.crowd, seen_from(here, flock, first + k));
                });
            });
        return sums;
    }

    // Each rule acts on the velocity that the one before has left.
    void steer(double x, double y, const Sums& sums, double& vx, double& vy) const {
        double weight = s.separation_weight * s.dt;
        vx = vx + weight * sums.crowd[0];
        vy = vy + weight * sums.crowd[1];
        weight = s.alignment_weight * s.dt;
        const double part = 1.0 / double(sums.aligned),
                     share = 1.0 / double(sums.together);
        vx = vx + weight * (sums.aligned ? sums.all[2] * part - vx : 0.0);
        vy = vy + weight * (sums.aligned ? sums.all[3] * part - vy : 0.0);
        weight = s.cohesion_weight * s.dt;
        vx = vx + weight * (sums.together ? sums.all[0] * share : 0.0);
        vy = vy + weight * (sums.together ? sums.all[1] * share : 0.0);
        vx += border(x, vx, trial.world.width) * s.dt;
        vy += border(y, vy, trial.world.height) * s.dt;
        double away_x, away_y;
        obstacles.repel(x, y, away_x, away_y,
                        [](__m512d) { return _mm512_set1_pd(1.0); });
        weight = s.obstacle_weight * s.dt;
        vx = vx + weight * away_x;
        vy = vy + weight * away_y;
    }

    double border(double position, double velocity, double length) const {
        const double back = turn_back(position, length, s.border_margin);
        const bool adds = s.border_adds_velocity == ALWAYS ||
                          (s.border_adds_velocity == IN_MARGIN && back != 0.0);
        return back * s.border_turn + (adds ? velocity : 0.0);
    }

    Settings s;
    Obstacles obstacles;
};

}  // namespace

extern "C" Flight* patel2023(const Trial* trial) { return begin<Patel2023>(trial); }
