"""Random clouds of bodies, to be reconstructed."""

import numpy as np


def cloud(rng, path):
    """Points of an ellipsoid, a ring or two bodies, some of them off."""
    count = int(10 ** rng.uniform(2.8, 3.2))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    kind = rng.integers(3)
    if kind == 0:
        points = directions * rng.uniform(1, 3, 3)
    elif kind == 1:
        turn, around = rng.uniform(0, 2 * np.pi, (2, count))
        wide = 3 + np.cos(around)
        points = np.stack([wide * np.cos(turn), wide * np.sin(turn), np.sin(around)], axis=1)
    else:
        points = directions + np.where(rng.random(count) < 0.5, 0, 3.5)[:, None] * np.array([1, 0, 0])
    points += rng.normal(scale=rng.choice([0, 0.01]), size=points.shape)
    np.savetxt(path, points + rng.uniform(-50, 50, 3), fmt="%.9g")


def job(pick, folder):
    """The arguments of a random reconstruction, whose input is made."""
    cloud(np.random.default_rng(pick.getrandbits(32)), folder / "cloud.xyz")
    words = ["reconstruct", "cloud.xyz", "--method", pick.choice(["vdt", "vdt", "fsm", "fmm"])]
    for flag, chance in (
        (["--beta", "0.6"], 0.15),
        (["--ome", "0.4"], 0.2),
        (["--live"], 0.15),
        (["--delta", "0.1"], 0.2),
        (["--mesh", "cloud.ply", "--overwrite"], 0.2),
    ):
        words += flag if pick.random() < chance else []
    return words
