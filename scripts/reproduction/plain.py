"""Algorithms 2 to 8 of Kósa and Mikula 2023 as they are printed, slow and plain; with what the errata change as a choice.

They answer what the paper's own program does: which of its figures come from the printed rule, and what it counts.
"""

import numpy as np
from numba import njit

from .plain_heap import pop, put
from .plain_start import distance


@njit(cache=True)
def order(sweep, shape):
    """First place, end and step along each axis, in sweep 0 to 7."""
    begin, end, step = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3, np.int64)
    for a in range(3):
        down = sweep >> a & 1 == 1
        begin[a], end[a], step[a] = (shape[a] - 1, -1, -1) if down else (0, shape[a], 1)
    return begin, end, step


@njit(cache=True)
def value(d, i, j, k):
    inside = 0 <= i < d.shape[0] and 0 <= j < d.shape[1] and 0 <= k < d.shape[2]
    return d[i, j, k] if inside else np.inf


@njit(cache=True)
def fsm(d, s, fixed, origin, h, triangles, upper_first, margin):
    """Alg. 2 with the sources of Alg. 7, taken literally; of two equal neighbours the upper one, or the lower."""
    a, place = np.empty(3), np.empty(3, np.int64)
    for sweep in range(8):
        begin, end, step = order(sweep, d.shape)
        for i in range(begin[0], end[0], step[0]):
            for j in range(begin[1], end[1], step[1]):
                for k in range(begin[2], end[2], step[2]):
                    if fixed[i, j, k]:
                        continue
                    for axis in range(3):
                        e = (axis == 0, axis == 1, axis == 2)
                        up, down = value(d, i + e[0], j + e[1], k + e[2]), value(d, i - e[0], j - e[1], k - e[2])
                        above = up <= down if upper_first else up < down
                        a[axis], place[axis] = (up, 1) if above else (down, -1)
                    new, used = upwind(a, h, margin)
                    if new < d[i, j, k]:
                        d[i, j, k] = new
                        for axis in range(3):
                            place[axis] *= used >> axis & 1
                        s[i, j, k] = s[i + place[0], j + place[1], k + place[2]]


@njit(cache=True)
def upwind(a, h, margin):
    """The solution of Alg. 2, lines 9 to 16, and the axes that entered, as bits: those exceeded by more than a margin."""
    first = np.argmin(a)
    last = 2 - np.argmax(a[::-1])
    if last == first:
        return np.inf if np.isinf(a[0]) else a[0] + h, 1
    middle = 3 - first - last
    x, used = a[first] + h, 1 << first
    if x > a[middle] + margin:
        b, c = a[first], a[middle]
        x, used = 0.5 * (b + c + np.sqrt(2 * h * h - (b - c) ** 2)), used | 1 << middle
        if x > a[last] + margin:
            total = a[0] + a[1] + a[2]
            root = total * total - 3 * (a[0] ** 2 + a[1] ** 2 + a[2] ** 2 - h * h)
            x, used = (total + np.sqrt(root)) / 3, 7
    return x, used


@njit(cache=True)
def vdt(d, s, fixed, origin, h, triangles, neighbours):
    """Alg. 3; how many distances were computed."""
    count, open_ = 0, np.ones(d.shape, np.bool_)
    for sweep in range(8):
        begin, end, step = order(sweep, d.shape)
        for i in range(begin[0], end[0], step[0]):
            for j in range(begin[1], end[1], step[1]):
                for k in range(begin[2], end[2], step[2]):
                    if not fixed[i, j, k]:
                        count += take_nearest(d, s, open_, origin, h, triangles, neighbours, i, j, k)
    return count


@njit(cache=True)
def take_nearest(d, s, open_, origin, h, triangles, neighbours, i, j, k):
    """Keeps the nearest of the sources of open neighbours; how many distances that took."""
    count = 0
    x, y, z = origin[0] + i * h, origin[1] + j * h, origin[2] + k * h
    for n in range(len(neighbours)):
        a, b, c = i + neighbours[n, 0], j + neighbours[n, 1], k + neighbours[n, 2]
        if not (0 <= a < d.shape[0] and 0 <= b < d.shape[1] and 0 <= c < d.shape[2]):
            continue
        if open_[a, b, c] and s[a, b, c] >= 0:
            count += 1
            new = distance(triangles[s[a, b, c]], x, y, z)
            if new < d[i, j, k]:
                d[i, j, k], s[i, j, k] = new, s[a, b, c]
    return count


@njit(cache=True)
def dp(d, s, fixed, origin, h, triangles, neighbours, printed):
    """Alg. 5; how many distances were computed. `printed`: fixed neighbours are passed over, and d + h may stay."""
    heap, keys, open_ = started(d, fixed)
    done, count = np.zeros(d.shape, np.bool_), 0
    lengths = h * np.sqrt((neighbours * neighbours).sum(axis=1).astype(np.float64))
    while len(heap) > 1:
        key, i, j, k = pop(heap, keys, d.shape)
        if done[i, j, k]:
            continue
        if not fixed[i, j, k]:
            if not printed:
                d[i, j, k] = np.inf
            count += take_nearest(d, s, open_, origin, h, triangles, neighbours, i, j, k)
        done[i, j, k] = True
        open_[i, j, k] = not (printed and fixed[i, j, k])
        for n in range(len(neighbours)):
            a, b, c = i + neighbours[n, 0], j + neighbours[n, 1], k + neighbours[n, 2]
            if not (0 <= a < d.shape[0] and 0 <= b < d.shape[1] and 0 <= c < d.shape[2]):
                continue
            new = d[i, j, k] + lengths[n]
            if not fixed[a, b, c] and not done[a, b, c] and new < d[a, b, c]:
                d[a, b, c], s[a, b, c] = new, s[i, j, k]
                put(heap, keys, new, (a * d.shape[1] + b) * d.shape[2] + c)
    return count


@njit(cache=True)
def fmm(d, s, fixed, origin, h, triangles, neighbours, printed):
    """Alg. 4 with the sources of Alg. 8. `printed`: all finite neighbours enter one quadratic; else frozen upwind ones."""
    heap, keys, _ = started(d, fixed)
    done = np.zeros(d.shape, np.bool_)
    while len(heap) > 1:
        key, i, j, k = pop(heap, keys, d.shape)
        if done[i, j, k]:
            continue
        done[i, j, k] = True
        for n in range(6):
            o = neighbours[n]
            a, b, c = i + o[0], j + o[1], k + o[2]
            if not (0 <= a < d.shape[0] and 0 <= b < d.shape[1] and 0 <= c < d.shape[2]):
                continue
            if fixed[a, b, c] or done[a, b, c]:
                continue
            new = one_quadratic(d, a, b, c, h) if printed else frozen_upwind(d, done, a, b, c, h)
            if new < d[a, b, c]:
                d[a, b, c] = new
                put(heap, keys, new, (a * d.shape[1] + b) * d.shape[2] + c)
        if not fixed[i, j, k]:
            s[i, j, k] = parent(d, s, done, h, i, j, k)


@njit(cache=True)
def one_quadratic(d, i, j, k, h):
    """Lines 5 to 15 of Alg. 4; infinite where the discriminant is negative (no comparison is true of NaN)."""
    a = b = c = 0.0
    for axis in range(3):
        r, t, u = axis == 0, axis == 1, axis == 2
        x = min(value(d, i + r, j + t, k + u), value(d, i - r, j - t, k - u))
        if x < np.inf:
            a, b, c = a + 1, b + x, c + x * x
    a, b, c = a / (h * h), -2 * b / (h * h), c / (h * h) - 1
    root = b * b - 4 * a * c
    return (-b + np.sqrt(root)) / (2 * a) if root >= 0 else np.inf


@njit(cache=True)
def frozen_upwind(d, done, i, j, k, h):
    a = np.full(3, np.inf)
    for axis in range(3):
        r, t, u = axis == 0, axis == 1, axis == 2
        for sign in (-1, 1):
            p, q, v = i + sign * r, j + sign * t, k + sign * u
            if value(d, p, q, v) < a[axis] and done[p, q, v]:
                a[axis] = d[p, q, v]
    return upwind(a, h, 0.0)[0]


@njit(cache=True)
def parent(d, s, done, h, i, j, k):
    """Lines 25 to 36 of Alg. 8: the source of the frozen one of 26 neighbours with the smallest way."""
    best, source = np.inf, np.int32(-1)
    for r in range(-1, 2):
        for t in range(-1, 2):
            for u in range(-1, 2):
                way = value(d, i + r, j + t, k + u) + h * np.sqrt(float(r * r + t * t + u * u))
                if way < best and done[i + r, j + t, k + u] and (r, t, u) != (0, 0, 0):
                    best, source = way, s[i + r, j + t, k + u]
    return source


@njit(cache=True)
def started(d, fixed):
    """A heap of all fixed points, and where sources may be taken from: nowhere yet."""
    heap, keys = [0], [-np.inf]
    flat_d, flat_fixed = d.ravel(), fixed.ravel()
    for place in range(flat_d.size):
        if flat_fixed[place]:
            put(heap, keys, flat_d[place], place)
    return heap, keys, np.zeros(d.shape, np.bool_)
