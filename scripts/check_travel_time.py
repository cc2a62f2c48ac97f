#!/usr/bin/env python3
"""Checks travel times through an image of speeds, which strandline computes, with scikit-fmm and with a known answer.

    check_travel_time.py PROGRAM [--finest N] [--seed S]

In smooth random media, from a point, beside scikit-fmm's `travel_time` of first order: two first-order schemes with other
starts, whose difference must fall with the spacing. In two layers, from a point and from a sphere: the first arrival is the
straight way, Snell's bent one, or the head wave along the border; the mean error must fall with about the first order, from a
point with h log h. Prints a table, and ends with 1 where a bound is not kept. Needs numpy, scipy, scikit-fmm and zarr.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import skfmm
import zarr
from scipy.ndimage import zoom


def write_nrrd(path, speeds, h):
    z, y, x = speeds.shape
    header = f"NRRD0004\ntype: float\ndimension: 3\nsizes: {x} {y} {z}\nspacings: {h!r} {h!r} {h!r}\nendian: little\nencoding: raw\n\n"
    path.write_bytes(header.encode() + np.ascontiguousarray(speeds, "<f4").tobytes())


def write_sphere(path, centre, radius, rows=64):
    polar, around = np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, 2 * rows, endpoint=False)
    places = [
        centre + radius * np.array([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)])
        for p in polar
        for a in around
    ]
    lines, wide = [], len(around)
    for row in range(rows):
        for n in range(wide):
            a, b = row * wide + n, row * wide + (n + 1) % wide
            lines += [f"3 {a} {a + wide} {b}", f"3 {b} {a + wide} {b + wide}"]
    text = [f"OFF\n{len(places)} {len(lines)} 0"] + ["{} {} {}".format(*map(float, p)) for p in places] + lines
    path.write_text("\n".join(text) + "\n")


def times(program, folder, source, speeds, h, *flags):
    write_nrrd(folder / "speed.nrrd", speeds, h)
    out = folder / "times.zarr"
    command = [program, "distance", source, "--speed", folder / "speed.nrrd", "-q", "-o", out, "--overwrite", *flags]
    subprocess.run([str(word) for word in command], check=True)
    return zarr.open_array(out / "0", mode="r")[...].astype(float)


def first_arrival(source, x, y, z, border, below, above):
    """From a source below the plane z = border, at speeds below and above it."""
    along, depth = np.hypot(x - source[0], y - source[1]), border - source[2]
    direct = np.hypot(along, z - source[2]) / below
    if above > below:
        sine = below / above
        cosine = np.sqrt(1 - sine**2)
        up = depth + border - z
        head = along / above + up * cosine / below
        direct = np.where(along >= up * sine / cosine, np.minimum(direct, head), direct)
    height = np.maximum(z - border, 0)
    low, high = np.zeros_like(along), along.copy()
    for _ in range(60):
        middle = (low + high) / 2
        slope = (
            middle / np.hypot(middle, depth) / below
            - (along - middle) / np.maximum(np.hypot(along - middle, height), 1e-300) / above
        )
        low, high = np.where(slope < 0, middle, low), np.where(slope < 0, high, middle)
    bent = np.hypot(low, depth) / below + np.hypot(along - low, height) / above
    return np.where(z <= border, direct, bent)


def places(n):
    axis = np.arange(n + 1) / n
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return x, y, z


def by_scikit_fmm(source, speeds, n, start):
    """From a small ball around the source, whose speed is that at the source."""
    x, y, z = places(n)
    away = np.sqrt((x - source[0]) ** 2 + (y - source[1]) ** 2 + (z - source[2]) ** 2)
    found = skfmm.travel_time(away - start, speeds, dx=1 / n, order=1)
    at = tuple(round(v * n) for v in source[::-1])
    return np.where(away > start, np.ma.filled(found, np.inf) + start / speeds[at], away / speeds[at]), away


def random_media(program, folder, finest, seed, problems):
    print("random media, from a point: the difference to scikit-fmm, in parts of the largest time")
    rng = np.random.default_rng(seed)
    for medium in range(3):
        coarse, source, first = rng.normal(size=(6, 6, 6)), rng.uniform(0.3, 0.7, 3), None
        (folder / "point.xyz").write_text("{} {} {}\n".format(*map(float, source)))
        for n in (finest // 4, finest // 2, finest):
            smooth = zoom(coarse, (n + 1) / 6, order=3, grid_mode=True, mode="nearest")[: n + 1, : n + 1, : n + 1]
            speeds = np.exp(0.5 * smooth).astype("f4").astype(float)
            ours = times(program, folder, folder / "point.xyz", speeds, 1 / n)
            theirs, away = by_scikit_fmm(source, speeds, n, 1.5 / n)
            apart = np.abs(ours - theirs)[away > 3 / n] / ours.max()
            print(
                f"  medium {medium}, 1/{n}: mean {apart.mean():.5f}, largest {apart.max():.5f}; speeds from {speeds.min():.2f} to {speeds.max():.2f}"
            )
            first = first or apart.mean()
        if apart.mean() > min(0.5 * first, 0.003):
            problems.append(
                f"the difference to scikit-fmm is {apart.mean()} in medium {medium}, {first} on the coarsest grid"
            )


def two_layers(program, folder, finest, problems):
    print("two layers: mean error, its order; largest error; scikit-fmm's mean error")
    source, radius, border = np.array([0.4, 0.45, 0.3]), 0.15, 0.55
    (folder / "point.xyz").write_text("{} {} {}\n".format(*map(float, source)))
    write_sphere(folder / "sphere.off", source, radius)
    for below, above in ((1.0, 3.0), (2.0, 1.0)):
        for name, least, later in (("point.xyz", 0.55, 0.0), ("sphere.off", 0.8, radius / below)):
            before = None
            for n in (finest // 4, finest // 2, finest):
                x, y, z = places(n)
                # Midway between two planes of voxels.
                middle = (np.floor(border * n) + 0.5) / n
                speeds = np.where(z > middle, above, below)
                known = first_arrival(source, x, y, z, middle, below, above)
                away = np.sqrt((x - source[0]) ** 2 + (y - source[1]) ** 2 + (z - source[2]) ** 2)
                far = away > radius + 1 / n
                error = np.abs(times(program, folder, folder / name, speeds, 1 / n) + later - known)[far]
                order = "" if before is None else f"{np.log2(before / error.mean()):.2f}"
                beside = (
                    "" if later else f"{np.abs(by_scikit_fmm(source, speeds, n, 1.001 / n)[0] - known)[far].mean():.5f}"
                )
                print(
                    f"  speeds {below:g}, {above:g}, {name:10} 1/{n}: {error.mean():.5f} {order:4}  {error.max():.5f}  {beside}"
                )
                if before is not None and np.log2(before / error.mean()) < least:
                    problems.append(f"the order is {order} in layers {below}, {above} from {name}")
                before = error.mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path)
    parser.add_argument(
        "--finest", type=int, default=96, help="voxels along an edge of the finest grid, a multiple of 4"
    )
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    problems = []
    with tempfile.TemporaryDirectory() as folder:
        random_media(arguments.program, Path(folder), arguments.finest, arguments.seed, problems)
        two_layers(arguments.program, Path(folder), arguments.finest, problems)
    if problems:
        sys.exit("; ".join(problems))


if __name__ == "__main__":
    main()
