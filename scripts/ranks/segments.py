"""Random segmentations: bright bodies in a noisy image, outlined on slices."""

import numpy as np


def bodies(rng, shape):
    """Ellipsoids, centre and half axes in voxels (x, y, z), that lie inside of the image."""
    low, high = np.full(3, 6.0), np.minimum(0.3 * np.array(shape), 16.0)
    axes = [low + rng.random(3) * np.maximum(high - low, 0.1) for _ in range(rng.integers(1, 7))]
    return [(a + 2 + rng.random(3) * (np.array(shape) - 2 * a - 4), a) for a in axes]


def image(rng, shape, found, spacing, path):
    """An NRRD volume of the bodies, of one type or another."""
    z, y, x = np.mgrid[: shape[2], : shape[1], : shape[0]].astype(float)
    level = np.full(x.shape, 40.0)
    for centre, axes in found:
        radius = sum(((v - c) / a) ** 2 for v, c, a in zip((x, y, z), centre, axes))
        level[radius < 1] = 150
        if rng.random() < 0.3:
            level[np.abs(np.sqrt(radius) - 1) < 0.12] = 230
    level += rng.normal(scale=6, size=level.shape)
    dtype, name = [(np.uint8, "uint8"), (np.uint16, "uint16"), (np.float32, "float")][rng.integers(3)]
    header = f"NRRD0004\ntype: {name}\ndimension: 3\nsizes: {shape[0]} {shape[1]} {shape[2]}\n"
    header += f"spacings: {' '.join(f'{h:.6g}' for h in spacing)}\nendian: little\nencoding: raw\n\n"
    path.write_bytes(header.encode() + np.clip(level, 0, 255).astype(dtype).tobytes())


def outlines(rng, found, spacing, path):
    """Marks on some slices of each body; of one of them, now and then, too few."""
    rows = ["object,contour,x,y,z"]
    poor = rng.integers(len(found)) if len(found) > 1 and rng.random() < 0.2 else -1
    for number, (centre, axes) in enumerate(found):
        step = rng.integers(2, 5)
        slices = [z for z in range(int(centre[2] - axes[2]) + 1, int(centre[2] + axes[2]), step)]
        for contour, z in enumerate(slices[:1] if number == poor else slices):
            part = np.sqrt(max(0.0, 1 - ((z - centre[2]) / axes[2]) ** 2))
            turns = 2 * np.pi * np.arange(20) / 20
            xs = centre[0] + part * axes[0] * np.cos(turns) + rng.normal(scale=0.2, size=20)
            ys = centre[1] + part * axes[1] * np.sin(turns) + rng.normal(scale=0.2, size=20)
            for px, py in zip(xs, ys):
                place = ",".join(f"{v * h:.5g}" for v, h in zip((px, py, z), spacing))
                rows.append(f"{number + 1},{contour},{place}")
    path.write_text("\n".join(rows) + "\n")


def job(pick, folder):
    """The arguments of a random segmentation, whose inputs are made."""
    rng = np.random.default_rng(pick.getrandbits(32))
    shape = [pick.randint(50, 150), pick.randint(50, 150), pick.randint(30, 90)]
    spacing = [0.5, 0.5, pick.choice([0.5, 0.8, 1.0])]
    found = bodies(rng, shape)
    image(rng, shape, found, spacing, folder / "image.nrrd")
    outlines(rng, found, spacing, folder / "marks.csv")
    words = ["segment", "image.nrrd", "--points", "marks.csv", "--brick", str(pick.choice([32, 64]))]
    for flag, chance in (
        (["--fill-gaps", "auto"], 0.3),
        (["--cross-validate"], 0.2),
        (["--start", "flood"], 0.2),
        (["--ome", "0.4"], 0.2),
        (["--live"], 0.15),
        (["--overlap", pick.choice(["larger", "first", "last"])], 0.2),
    ):
        words += flag if pick.random() < chance else []
    return words
