"""The baseline: aziel_chen2025 as_run as one careful all-pairs loop, hand-inlined, with
nothing shared.
"""

import math

import numba


@numba.njit(cache=True, error_model="numpy")
def plain_run(x, y, vx, vy, obstacles, weights, visits, steps):
    """Advance `steps` updates; `obstacles` (M, 3) holds centre and size, `weights`
    cohesion, alignment, separation.

    `visits` (height, width) counts footprints, negative in obstacles; returns the
    number of pixels visited.
    """
    n, m = x.size, obstacles.shape[0]
    rows, columns = visits.shape
    height, width = float(rows), float(columns)
    cohesion, alignment, separation = weights
    cosine = math.cos(math.radians(75.0))
    covered = 0
    for _ in range(steps):
        for i in range(n):
            xi, yi, ui, wi = x[i], y[i], vx[i], vy[i]
            bound = cosine * cosine * (ui * ui + wi * wi)
            sx, sy, mx, my, mu, mw, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
            for j in range(n):
                dx, dy = x[j] - xi, y[j] - yi
                d2 = dx * dx + dy * dy
                if d2 < 2500.0 and j != i:
                    along = dx * ui + dy * wi
                    if along > 0.0 and along * along >= bound * d2:
                        count += 1
                        mx += dx
                        my += dy
                        mu += vx[j]
                        mw += vy[j]
                        if d2 < 400.0:
                            sx -= dx
                            sy -= dy
            ox, oy = 0.0, 0.0
            for k in range(m):
                dx, dy = xi - obstacles[k, 0], yi - obstacles[k, 1]
                d2 = dx * dx + dy * dy
                size = obstacles[k, 2] + 40.0
                if d2 < size * size:
                    d = math.sqrt(d2)
                    scale = 1.0 / (d * (d + 1e-10))
                    ox += dx * scale
                    oy += dy * scale
            wall_x = 10.0 * (1.0 / (xi + 1e-10) - 1.0 / (width - xi + 1e-10))
            wall_y = 10.0 * (1.0 / (yi + 1e-10) - 1.0 / (height - yi + 1e-10))
            ali_x, ali_y, coh_x, coh_y = 0.0, 0.0, 0.0, 0.0
            if count > 0:
                share = 1.0 / count
                ali_x, ali_y = (
                    alignment * (mu * share - ui),
                    alignment * (mw * share - wi),
                )
                coh_x, coh_y = cohesion * (mx * share), cohesion * (my * share)
            ax, ay, left = 0.0, 0.0, 0.5
            for f in range(5):
                if f == 0:
                    fx, fy = separation * sx, separation * sy
                elif f == 1:
                    fx, fy = 500.0 * ox, 500.0 * oy
                elif f == 2:
                    fx, fy = wall_x, wall_y
                elif f == 3:
                    fx, fy = ali_x, ali_y
                else:
                    fx, fy = coh_x, coh_y
                length = math.sqrt(fx * fx + fy * fy)
                if length > left:
                    ax += fx * (left / length)
                    ay += fy * (left / length)
                    break
                ax += fx
                ay += fy
                left -= length
            ui += ax
            wi += ay
            speed2 = ui * ui + wi * wi
            if speed2 > 25.0:
                scale = 5.0 / math.sqrt(speed2)
                ui *= scale
                wi *= scale
            xi += ui
            yi += wi
            x[i], y[i], vx[i], vy[i] = xi, yi, ui, wi
            column, row = int(xi), int(yi)
            for dr in range(-2, 3):
                reach = 2 if dr == 0 else (1 if abs(dr) == 1 else 0)
                r = row + dr
                if 0 <= r < rows:
                    for c in range(
                        max(0, column - reach), min(columns - 1, column + reach) + 1
                    ):
                        covered += visits[r, c] == 0
                        visits[r, c] += 1
    return covered
