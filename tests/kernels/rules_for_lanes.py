"""Rules as users may write them. Each works on numbers `row`, in lanes on rows."""

# ruff: noqa: ARG001
import math

from kernels.elementary import atan2, exp, expm1, log, power, sin, sine_cosine
from kernels.indices import whole
from kernels.jit import jit
from tests.kernels import more_rules_for_lanes as more

POWER = 3


@jit
def keywords_of_draws(row, near, found, rng, watch):
    row[1] = rng.normal(row[2], scale=0.5)
    row[2] = rng.uniform(low=-3.0, high=0.5)


@jit
def or_of_counts(row, near, found, rng, watch):
    count = 0
    for k in range(found):
        if near.dx[k] > 0.0:
            count += 1
    row[1] = 1.0 / (count or 1)
    row[2] = 2.0 * (count and 4)


@jit
def draw_in_a_chain(row, near, found, rng, watch):
    row[1] = 1.0 if row[2] < rng.random() < row[3] else 0.0
    row[4] = rng.random()


@jit
def negative_places(row, near, found, rng, watch):
    for i in range(3):
        row[i] = row[i - 1] + row[-2]


@jit
def even_ones_and_what_follows(row, near, found, rng, watch):
    total, has = 0.0, 0.0
    for k in range(found):
        if near.boid[k] % 2 == 0:
            held = near.dx[k]
            has = 1.0
        if near.boid[k] % 2 == 1 and has > 0.0:
            total += held
    row[1] = total


@jit
def helpers_of_a_module(row, near, found, rng, watch):
    x, y = more.first_way(near)
    row[1] = x
    row[2] = y


@jit
def numbers_of_a_module(row, near, found, rng, watch):
    row[1] = more.halved(row[2], row[3] > 0.0)
    row[2] = more.noisy(rng, row[4])
    noise = rng.normal(0.0, 1.0)
    row[3] = noise if noise > 0.0 else -1.0


@jit
def writes_by_a_module(row, near, found, rng, watch):
    done = 0.0
    if row[1] > 0.0:
        done = more.writes(row)
    row[5] = done


@jit
def writes_deeper(row, near, found, rng, watch):
    done = 0.0
    if row[1] > 0.0:
        done = _writes_by_another(row)
    row[5] = done


@jit
def _writes_by_another(row):
    return more.writes(row) + 0.0


@jit
def powers(row, near, found, rng, watch):
    third = 5
    x = row[1]
    row[1] = row[2] ** -3
    row[2] = row[3] ** POWER
    row[3] = row[4] ** third
    row[4] = row[5] ** more.POWER
    x **= 7
    row[5] = x


@jit
def names_of_tools(row, near, found, rng, watch):
    row[1] = _where(row[1], row[2], row[3])


@jit
def _where(test, one, other):
    return test * one + other


@jit
def names_of_parameters(row, near, found, rng, watch):
    row[1] = _lookup(row[1], 4)
    row[2] = _halved(row[2], 2.5)


@jit
def _lookup(x, at):
    while x > 1.0:
        x -= 0.5
    return x * at


@jit
def _halved(result, least):
    while result > least:
        result *= 0.5
    return result


@jit
def truth_as_number(row, near, found, rng, watch):
    count = 0
    for k in range(found):
        if near.dx[k] > 0.0:
            count += 1
    row[1] = 1.0 * bool(count)
    row[2] = 1.0 * bool(row[2])
    row[3] = -(row[3] > 0.0) + 2 * (row[4] > 0.0)


@jit
def factors_of_neighbours(row, near, found, rng, watch):
    for k in range(whole(found)):
        near.factor[k] = near.dx[k] if near.distance2[k] < 4.0 else 0.5
    for k in range(found):
        if near.dy[k] > 0.0:
            near.factor[k] *= 2.0
    for k in range(found):
        row[1] += near.factor[k]
        row[2] -= near.dy[k] * near.factor[k]


@jit
def events_that_are_read(row, near, found, rng, watch):
    watch.events[0] += int(row[1] > 0.0)
    if watch.events[1] > 0:
        row[1] = 0.0
    watch.events[1] += 1
    if row[2] > 0.0:
        watch.events[2] += 1


@jit
def loops_that_need_their_test(row, near, found, rng, watch):
    x = math.floor(abs(row[0])) * 1.0
    if x > 0.0:
        row[1] = _doublings(x)


@jit
def _doublings(x):
    count = 0.0
    while x < 8.0 and count < 1e6:
        x *= 2.0
        count += 1.0
    return count


@jit
def assigned_within(row, near, found, rng, watch):
    d = 0.0
    total = 0.0
    if row[1] > 0.0:
        total = (d := row[2] + 1.0) * d
    row[3] = total
    row[4] = d


@jit
def returns_within(row, near, found, rng, watch):
    row[1] = _nested(row[1], row[2], row[3])
    row[2] = _by_kind(row[1], row[2])


@jit
def _nested(x, y, z):
    if x > 0.0:
        if y > 0.0:
            if z > 0.0:
                return x / y
            y = z * 2.0 / x
        elif z < 0.0:
            return math.sqrt(-z) / x
        x = x + y
    return x - y


@jit
def _by_kind(x, y):
    if x > 1e6:
        a = math.cos(x) / y
        if y > 0.0:
            return a
    if x < 0.0:
        a, b = x, y
    else:
        b, a = x / 2.0, y
    return a * b - a / (b + 3.0)


@jit
def arithmetic(row, near, found, rng, watch):
    n = math.floor(row[1])
    m = n // 3 + n % 5
    flag = row[2] > 0.0
    other = row[3] > 0.0
    a = flag + other
    b = flag * 2 - other
    c = max(flag, n, 0.5)
    d = min(1, row[1], row[2], row[3])
    e = not flag
    f = (flag and not other) or row[4] > 1.0
    g = 3 if flag else 2.5
    row[1] = m / 7 + a + b
    row[2] = c - d
    row[3] = e + f * 2.0 + g
    row[4] = row[4] % 0.7 + row[5] // 0.3
    row[5] = math.atan2(a, b) + math.copysign(1.0, -row[0]) + abs(-row[0])


@jit
def special_numbers(row, near, found, rng, watch):
    zero = row[0] * 0.0
    nan = zero / zero
    infinite = 1.0 / zero
    row[1] = 1.0 if nan != nan else 2.0
    row[2] = max(nan, 1.0) if row[2] > 0.0 else max(1.0, nan)
    row[3] = math.copysign(1.0, min(zero, -zero))
    row[4] = infinite if infinite > 1e300 else -infinite
    row[5] = 1.0 / max(-zero, zero)


@jit
def swaps(row, near, found, rng, watch):
    x, y, z = row[1], row[2], row[3]
    if x > y:
        x, y = y, x
    if y > z:
        y, z = z, y
    if x > y:
        x, y = y, x
    row[1], row[2], row[3] = row[3], x, y
    row[4] = z
    for k in range(found):
        row[near.boid[k]] += near.dx[k]
        if near.dx[k] > 0.5 > near.dy[k]:
            row[near.boid[k]], row[0] = row[0], row[near.boid[k]]


@jit
def events_that_are_counted(row, near, found, rng, watch):
    watch.events[0] += int(row[1] > 0.0)
    watch.events[1] += 1
    if row[2] > 0.0:
        watch.events[2] += 1


@jit
def events_that_are_set(row, near, found, rng, watch):
    watch.events[0] = 2


@jit
def kinds_written_by_a_helper(row, near, found, rng, watch):
    row[1] = _mark(near.boid, row[2])
    row[2] = 1.0 * near.boid[0]


@jit
def _mark(kind, x):
    if x > 0.0:
        kind[0] = 9
    return x


@jit
def whole_numbers_as_tests(row, near, found, rng, watch):
    n = math.floor(row[1])
    row[2] = 1.0 if n else 2.0
    row[3] = 1.0 if not n else 2.0


@jit
def elementary_functions(row, near, found, rng, watch):
    """Of ordinary arguments, and of some whose results are next to 0 or infinite."""
    one, other = row[1], abs(row[2])
    row[0] = exp(one) + exp(400.0 * row[3])
    row[1] = power(other, one)
    row[2] = power(other, 500.0 * one)
    row[3] = log(other) if one > 0.0 else sin(other)
    sine, cosine = sine_cosine(30.0 * one)
    row[4] = sine + 10.0 * cosine
    row[5] = atan2(one, other) + 10.0 * expm1(one)


@jit
def functions_of_neighbours(row, near, found, rng, watch):
    for k in range(whole(found)):
        weight = power(0.5 + near.distance2[k], -0.7)
        near.factor[k] = weight * exp(-near.distance2[k])
    for k in range(found):
        row[1] += near.factor[k] * near.dx[k]
