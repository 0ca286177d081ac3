// nguyen2024 as its author ran it: sequential, on a torus.
#include "flight.hpp"

namespace {

// numpy's PCG64.
class Pcg64 {
public:
    explicit Pcg64(const u64* words)
        : state_(wide(words[0], words[1])), increment_(wide(words[2], words[3])) {}

    double uniform(double low, double high) {
        state_ = state_ * wide(2549297995355413924u, 4865540595714422341u) + increment_;
        const u64 top = u64(state_ >> 64);
        const u64 bits = std::rotr(top ^ u64(state_), int(top >> 58));
        return low + (high - low) * (double(bits >> 11) * 0x1p-53);
    }

private:
    using Wide = unsigned __int128;
    static Wide wide(u64 high, u64 low) { return Wide(high) << 64 | low; }

    Wide state_, increment_;
};

class Nguyen2024 final : public Flight {
public:
    struct Settings {
        double separation_weight, alignment_weight, cohesion_weight, wander_weight;
        double obstacle_weight, separation_range, alignment_range, cohesion_range;
        double wander_range, obstacle_range, max_force, displacement_factor, drag;
        double range_inclusive, update, dt;
    };

    explicit Nguyen2024(const Trial& trial)
        : Flight(trial),
          s(settings_of<Settings>(trial)),
          random(trial.random),
          obstacles(trial.world, s.obstacle_range),
          scale(room_for(8 * flock.blocks, 0.0)) {}

private:
    struct Sums {
        __m256d all = _mm256_setzero_pd(), crowd = _mm256_setzero_pd();
        i64 together = 0, aligned = 0;
    };

    void advance() override {
        const double factor = s.displacement_factor * s.dt, kept = 1.0 - s.drag;
        for (i64 i = 0; i < flock.n; ++i) {
            const double x = flock.row(i)[0], y = flock.row(i)[1];
            const double vx = flock.row(i)[2], vy = flock.row(i)[3];
            double ax, ay;
            accelerate(x, y, vx, vy, look_about(i), ax, ay);
            const double new_vx = vx + ax * s.dt, new_vy = vy + ay * s.dt;
            flock.set(i, wrapped(x + factor * new_vx, trial.world.width),
                      wrapped(y + factor * new_vy, trial.world.height), new_vx * kept,
                      new_vy * kept);
        }
    }

    static double wrapped(double position, double length) {
        return position < 0         ? position + length
               : position >= length ? position - length
                                    : position;
    }

    // The sums over all in cohesion range, of velocities over those in alignment range,
    // and of unit vectors to those in separation range.
    Sums look_about(i64 i) {
        alignas(32) static constexpr double COUNTS[2][4] = {{1, 1, 0, 0}, {1, 1, 1, 1}};
        const __m512d x = _mm512_set1_pd(flock.row(i)[0]);
        const __m512d y = _mm512_set1_pd(flock.row(i)[1]);
        const __m256d here = _mm256_set_pd(0, 0, flock.row(i)[1], flock.row(i)[0]);
        const __m512d one = _mm512_set1_pd(1.0);
        const double cohesion2 = s.cohesion_range * s.cohesion_range;
        const double alignment2 = s.alignment_range * s.alignment_range;
        const double separation2 = s.separation_range * s.separation_range;
        double* const scales = scale.get();
        Sums sums;
        search<3>(
            flock, i,
            [&](i64 first, __m512d to_x, __m512d to_y, __mmask8* found) {
                const __m512d distance2 =
                    square_distance(_mm512_sub_pd(to_x, x), _mm512_sub_pd(to_y, y));
                found[0] = is_below(distance2, cohesion2);
                found[1] = is_below(distance2, alignment2);
                found[2] = is_below(distance2, separation2);
                if (found[2])
                    _mm512_store_pd(
                        scales + first,
                        _mm512_div_pd(one,
                                      _mm512_max_pd(_mm512_sqrt_pd(distance2), one)));
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
                    const __m256d unit = _mm256_set1_pd(scales[first + k]);
                    const __m256d seen = seen_from(here, flock, first + k);
                    sums.crowd = _mm256_sub_pd(sums.crowd, _mm256_mul_pd(seen, unit));
                });
            });
        return sums;
    }

    void accelerate(double x, double y, double vx, double vy, const Sums& sums,
                    double& ax, double& ay) {
        double force_x = sums.crowd[0], force_y = sums.crowd[1];
        limit(force_x, force_y, s.max_force);
        ax = s.separation_weight * force_x;
        ay = s.separation_weight * force_y;
        const double part = 1.0 / double(sums.aligned),
                     share = 1.0 / double(sums.together);
        force_x = sums.aligned ? sums.all[2] * part - vx : 0.0;
        force_y = sums.aligned ? sums.all[3] * part - vy : 0.0;
        limit(force_x, force_y, s.max_force);
        ax = ax + s.alignment_weight * force_x;
        ay = ay + s.alignment_weight * force_y;
        force_x = sums.together ? sums.all[0] * share : 0.0;
        force_y = sums.together ? sums.all[1] * share : 0.0;
        limit(force_x, force_y, s.max_force);
        ax = ax + s.cohesion_weight * force_x;
        ay = ay + s.cohesion_weight * force_y;
        force_x = random.uniform(-s.wander_range, s.wander_range);
        force_y = random.uniform(-s.wander_range, s.wander_range);
        ax = ax + s.wander_weight * force_x;
        ay = ay + s.wander_weight * force_y;
        obstacles.repel(x, y, force_x, force_y, one_over);
        limit(force_x, force_y, s.max_force);
        ax = ax + s.obstacle_weight * force_x;
        ay = ay + s.obstacle_weight * force_y;
    }

    Settings s;
    Pcg64 random;
    Obstacles obstacles;
    Numbers scale;
};

}  // namespace

extern "C" Flight* nguyen2024(const Trial* trial) { return begin<Nguyen2024>(trial); }
