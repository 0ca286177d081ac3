// nanobot: sequential, in an open world.
#include "flight.hpp"

namespace {

class Nanobot final : public Flight {
public:
    struct Settings {
        double separation_weight, alignment_weight, cohesion_weight, separation_range;
        double perception_range, protected_count_once, border_margin, border_turn;
        double min_speed, max_speed, update, dt;
    };

    explicit Nanobot(const Trial& trial)
        : Flight(trial), s(settings_of<Settings>(trial)) {}

private:
    struct Sums {
        __m256d all = _mm256_setzero_pd(), crowd = _mm256_setzero_pd();
        i64 count = 0;
    };

    void advance() override {
        for (i64 i = 0; i < flock.n; ++i) {
            const double x = flock.row(i)[0], y = flock.row(i)[1];
            double vx = flock.row(i)[2], vy = flock.row(i)[3];
            steer(x, y, look_about(i), vx, vy);
            flock.set(i, x + vx * s.dt, y + vy * s.dt, vx, vy);
        }
    }

    Sums look_about(i64 i) const {
        const __m512d x = _mm512_set1_pd(flock.row(i)[0]);
        const __m512d y = _mm512_set1_pd(flock.row(i)[1]);
        const __m256d here = _mm256_set_pd(0, 0, flock.row(i)[1], flock.row(i)[0]);
        const bool apart = s.protected_count_once != 0.0;
        Sums sums;
        search<2>(
            flock, i,
            [&](i64, __m512d to_x, __m512d to_y, __mmask8* found) {
                const __m512d distance2 =
                    square_distance(_mm512_sub_pd(to_x, x), _mm512_sub_pd(to_y, y));
                found[1] = is_below(distance2, s.separation_range * s.separation_range);
                found[0] = is_below(distance2, s.perception_range * s.perception_range);
                found[0] &= apart ? ~found[1] : 255;
            },
            [&](i64 first, const u64* words) {
                sums.count += std::popcount(words[0]);
                each(words[0], [&](int k) {
                    sums.all =
                        _mm256_add_pd(sums.all, seen_from(here, flock, first + k));
                });
                each(words[1], [&](int k) {
                    sums.crowd =
                        _mm256_add_pd(sums.crowd, seen_from(here, flock, first + k));
                });
            });
        return sums;
    }

    void steer(double x, double y, const Sums& sums, double& vx, double& vy) const {
        if (sums.count > 0) {
            const double share = 1.0 / double(sums.count);
            const double centering = s.cohesion_weight * s.dt;
            const double matching = s.alignment_weight * s.dt;
            vx = vx + centering * (sums.all[0] * share);
            vy = vy + centering * (sums.all[1] * share);
            vx = vx + matching * (sums.all[2] * share - vx);
            vy = vy + matching * (sums.all[3] * share - vy);
        }
        const double avoiding = s.separation_weight * s.dt, turn = s.border_turn * s.dt;
        vx = vx - avoiding * sums.crowd[0];
        vy = vy - avoiding * sums.crowd[1];
        vx += turn * turn_back(x, trial.world.width, s.border_margin);
        vy += turn * turn_back(y, trial.world.height, s.border_margin);
        clamp_speed(vx, vy, s.min_speed, s.max_speed);
    }

    Settings s;
};

}  // namespace

extern "C" Flight* nanobot(const Trial* trial) { return begin<Nanobot>(trial); }
