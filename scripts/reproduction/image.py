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
    settings = {
        "seed": f"{half},{half},{half},1.35",
        "image-spacing": f"{h},{h},{h}",
        "edge": "plain",
        "smoothing": "heat",
    }
    settings |= {"rho": 1, "delta": 0.025, "sigma": h, "tau": h / 4, "epsilon": 0.01, "max-steps": 4000, "tol": 0.001}
    flags = [word for name, value in settings.items() for word in (f"--{name}", value)]
    mesh = setting.scratch / "image.ply"
    report = run(setting, ["segment", path], [*flags, "--k", 10, "--mesh", mesh])
    if not isinstance(report, str):
        picture.draw(mesh, page.ROOT / "docs" / "pictures" / "sponge-image.png")
    of_grey_values = run(setting, ["segment", path], [*flags, "--k", 10 * 255**2])
    return (
        "## The Sponge as an image, without points (Kósa PhD, Fig. 2.3)\n\n"
        "`segment sponge.tif --seed ... --edge plain`: v = -grad g, not normalised, delta = 0.025; the start is a ball around the Sponge. The\n"
        "thesis gives 255 inside, 0 outside and K = 10, and does not say of which values the gradient is taken. K is read here for values on [0, 1];\n"
        f"on 0 to 255 it would be 10 * 255^2 for those, and the surface passes through the border. The image's inside has {int(inside.sum()) * h**3:.3f}.\n\n"
        + page.table(
            ["K = 10 for values on", "volume", "pieces", "steps"],
            [["[0, 1]", *told(report)], ["0 to 255", *told(of_grey_values)]],
        )
        + "\n\n![from the image](pictures/sponge-image.png)"
    )


def told(report):
    if isinstance(report, str):
        return [report, "-", "-"]
    result = report["result"]
    return [f"{result['volume']:.3f}", result["components"], result["time_steps"]]
