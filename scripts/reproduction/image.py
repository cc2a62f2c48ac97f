"""The Sponge as an image, from a ball and without points (Kósa PhD, Fig. 2.3)."""

import numpy as np
import tifffile

from common import page

from . import picture
from .setting import run


def sponge(setting):
    """Kósa PhD, Fig. 2.3: the Sponge as an image of 255 inside and 0 outside, from a ball, without points."""
    h, half = 0.05, 1.5
    n = int(2 * half / h) + 1
    axis = np.linspace(-half, half, n)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    s2 = np.clip(z, -1, 1) ** 2
    ring = 0.207 + 2.003 * s2 - 1.123 * s2**2
    inside = (np.abs(z) < 1) & ((x / ring) ** 2 + y**2 < 1 - s2)
    path = setting.scratch / "sponge.tif"
    tifffile.imwrite(path, (255 * inside).astype(np.uint8), imagej=True, metadata={"axes": "ZYX"})
    middle = half
    flags = [
        "--seed",
        f"{middle},{middle},{middle},1.35",
        "--image-spacing",
        f"{h},{h},{h}",
        "--edge",
        "plain",
        "--smoothing",
        "heat",
        "--rho",
        1,
    ]
    flags += [
        "--delta",
        0.025,
        "--k",
        10,
        "--sigma",
        h,
        "--tau",
        h / 4,
        "--epsilon",
        0.01,
        "--max-steps",
        4000,
        "--tol",
        0.001,
    ]
    mesh = setting.scratch / "image.ply"
    report = run(setting, ["segment", path], [*flags, "--mesh", mesh])
    if isinstance(report, str):
        text = f"No result: {report}."
    else:
        result = report["result"]
        voxels = int(inside.sum())
        picture.draw(mesh, page.ROOT / "docs" / "pictures" / "sponge-image.png")
        text = (
            f"Volume {result['volume']:.3f} where the image's inside has {voxels * h**3:.3f}; {result['components']} piece, "
            f"{result['time_steps']} steps.\n\n![from the image](pictures/sponge-image.png)"
        )
    return (
        "## The Sponge as an image, without points (Kósa PhD, Fig. 2.3)\n\n"
        "`segment sponge.tif --seed ... --edge plain`: v = -grad g, not normalised, delta = 0.025, K = 10 for grey values on\n"
        "[0, 1] (the thesis gives 255 inside and 0 outside, and no range for K; on 0..255 g would be all but 0 on the whole border); the start is\n"
        f"a ball around the Sponge. {text}"
    )
