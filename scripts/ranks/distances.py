"""Random distances and middle surfaces."""

import numpy as np

METHODS = ("vdt", "vdt", "fsm", "fmm", "dp")


def cloud(rng, path):
    """Points on a ball, a plane with waves or anywhere, of any density."""
    count = int(10 ** rng.uniform(1, 4))
    points = rng.normal(size=(count, 3))
    kind = rng.integers(3)
    if kind == 0:
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    elif kind == 1:
        points[:, 2] = 0.2 * np.sin(3 * points[:, 0])
    np.savetxt(path, points * rng.uniform(0.3, 1.2) + rng.uniform(-1, 1, 3), fmt="%.9g")


def box(rng, path):
    """A closed box."""
    lo = rng.uniform(-1.5, 0.5, 3)
    hi = lo + rng.uniform(0.2, 1.5, 3)
    corners = [[(lo, hi)[n >> a & 1][a] for a in range(3)] for n in range(8)]
    faces = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in corners] + [f"f {' '.join(map(str, face))}" for face in faces]
    path.write_text("\n".join(lines) + "\n")


def speeds(rng, path, shape):
    """An image of speeds, rough or of a few kinds, with or without walls."""
    voxels = rng.uniform(0.1, 3, shape[::-1]) if rng.random() < 0.5 else rng.choice([0.5, 1, 4], shape[::-1])
    voxels[rng.random(voxels.shape) < rng.choice([0, 0.02, 0.2])] = 0
    head = f"NRRD0004\ntype: float\ndimension: 3\nsizes: {' '.join(map(str, shape))}\nendian: little\nencoding: raw\n\n"
    path.write_bytes(head.encode() + voxels.astype("<f4").tobytes())


def as_times(pick, words, has_meshes):
    """The same sources and grid for travel times."""
    left_out = ["--signed"] + ["--closest-point"] * has_meshes
    kept = [word for word in words if word not in left_out]
    kept[kept.index("--method") + 1] = pick.choice(["fsm", "fmm"])
    return kept + ["--speed", "speed.nrrd"]


def job(pick, folder):
    """The arguments of a random distance or middle surface, whose inputs are made."""
    rng = np.random.default_rng(pick.getrandbits(32))
    sources = []
    for number in range(pick.randint(1, 4)):
        is_box = pick.random() < 0.3
        name = f"{number}.{'obj' if is_box else 'xyz'}"
        (box if is_box else cloud)(rng, folder / name)
        sources.append(name)
    closed = all(name.endswith("obj") for name in sources)
    shape = [pick.randint(1, 200) for _ in range(3)]
    while np.prod(shape) > 4e6:
        shape[pick.randrange(3)] //= 2
    spacing = [4 / max(shape) * pick.uniform(0.6, 1.5) for _ in range(3)]
    words = [
        "distance",
        *sources,
        "--shape",
        ",".join(map(str, shape)),
        "--spacing",
        ",".join(f"{h:.6g}" for h in spacing),
    ]
    words += ["--origin=" + ",".join(f"{-n * h / 2:.6g}" for n, h in zip(shape, spacing))]
    words += ["--method", pick.choice(METHODS), "--schedule", pick.choice(["front", "front", "sweep"])]
    words += ["--brick", str(pick.choice([16, 32, 64])), "--precision", pick.choice(["f16", "f32", "f32", "f64"])]
    for flag, chance in (("--labels", 0.6), ("--closest-point", 0.4), ("--signed", 0.8 if closed else 0)):
        words += [flag] if pick.random() < chance else []
    limited = "front" in words and pick.random() < 0.25
    words += ["--max-distance", f"{pick.uniform(0.3, 2):.3g}"] if limited else []
    words += ["--ome", "0.4"] if pick.random() < 0.2 else []
    if pick.random() < 0.25:
        speeds(rng, folder / "speed.nrrd", shape)
        return as_times(pick, words, any(name.endswith("obj") for name in sources))
    return as_middle(pick, words) if pick.random() < 0.4 else words


def as_middle(pick, words):
    """The same sources and grid for the surface between them."""
    kept = [word for word in words if word not in ("--labels", "--signed", "--closest-point")]
    kept[0] = "middle"
    if sum(word.endswith((".xyz", ".obj")) for word in kept) < 2:
        kept.insert(1, kept[1])
    return kept + ["--labels", pick.choice(["exact", "tracked"])]
