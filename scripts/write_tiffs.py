"""Writes TIFF files of random content in random dialects with tifffile, for the readers' tests.

    write_tiffs.py SEED COUNT FOLDER

Prints a line of JSON for each: file, channels, times, size and spacing along x, y, z, unit; its voxels lie beside it as f64 in
the order channel, time, z, y, x.
"""

import json
import sys
from pathlib import Path

import numpy as np
import tifffile

METRES = {"um": 1e-6, "nm": 1e-9, "mm": 1e-3, "\u00b5m": 1e-6, "\\u00B5m": 1e-6, "micron": 1e-6}
NAMES = {
    "um": "micrometer",
    "nm": "nanometer",
    "mm": "millimeter",
    "\u00b5m": "micrometer",
    "\\u00B5m": "micrometer",
    "micron": "micrometer",
}


def pick(rng, values):
    return values[int(rng.integers(len(values)))]


def content(rng, dtype, shape):
    if np.issubdtype(dtype, np.floating):
        return (rng.normal(size=shape) * 100).astype(dtype)
    limits = np.iinfo(dtype)
    return rng.integers(limits.min, limits.max, size=shape, dtype=dtype, endpoint=True)


def storage(rng, kind):
    """How pages are stored, and whether one page may stand for all planes."""
    options = {"byteorder": pick(rng, "<>"), "photometric": "minisblack"}
    if kind != "imagej":
        options["bigtiff"] = bool(rng.integers(2))
    packing = pick(rng, [None, None, "zlib", "lzw", "zstd", "packbits"])
    if packing:
        options["compression"] = packing
        if packing != "packbits" and rng.integers(2):
            options["predictor"] = True
    layout = rng.integers(4)
    if layout == 0:
        options["tile"] = pick(rng, [(16, 16), (32, 16)])
    elif layout == 1:
        options["rowsperstrip"] = int(rng.integers(1, 9))
    elif layout == 2 and not packing and kind in ("imagej", "shaped"):
        options["truncate"] = True
    return options


def lengths(rng, kind):
    """Keys of the description, resolution, and the spacing and unit that they mean."""
    sizes = [round(float(rng.uniform(0.05, 5)), 4) for _ in range(3)]
    if kind == "plain":
        return {}, None, [None] * 3, None
    if kind == "ome":
        units = [pick(rng, ["\u00b5m", "nm", "mm"]) for _ in range(3)]
        keys = {}
        for axis, size, unit in zip("XYZ", sizes, units):
            keys[f"PhysicalSize{axis}"], keys[f"PhysicalSize{axis}Unit"] = size, unit
        scale = [size * METRES[unit] / METRES[units[0]] for size, unit in zip(sizes, units)]
        return keys, None, scale, NAMES[units[0]]
    resolution = (1 / sizes[0], 1 / sizes[1])
    unit = pick(rng, ["um", "nm", "mm", "micron", "\\u00B5m", None] if kind == "imagej" else ["um", "nm", "\u00b5m", None])
    keys, scale = {"spacing": sizes[2]}, list(sizes)
    if unit:
        keys["unit"] = unit
    if kind == "imagej" and unit and rng.integers(2):
        for axis, key in ((1, "yunit"), (2, "zunit")):
            if rng.integers(2):
                keys[key] = pick(rng, ["um", "nm", "mm"])
                scale[axis] = sizes[axis] * METRES[keys[key]] / METRES[unit]
    return keys, resolution, scale, NAMES.get(unit)


def write(rng, path):
    kind = pick(rng, ["imagej", "ome", "shaped", "plain"])
    types = ["u1", "u2", "f4"] if kind == "imagej" else ["u1", "u2", "u4", "i1", "i2", "f4", "f8"]
    dtype = np.dtype(pick(rng, types))
    order = "TZC" if kind == "imagej" else pick(rng, ["TZC", "TCZ", "CTZ", "CZT", "ZCT", "ZTC"])
    limits = {"T": (1, 4), "C": (1, 4), "Z": (2, 6), "Y": (3, 40), "X": (5, 40)}
    size = {axis: int(rng.integers(*limit)) for axis, limit in limits.items()}
    if kind == "plain":
        order, size["T"], size["C"] = "Z", 1, 1
    data = content(rng, dtype, [size[axis] for axis in order + "YX"])
    keys, resolution, spacing, unit = lengths(rng, kind)
    options = storage(rng, kind)
    if resolution:
        options["resolution"] = resolution
        options["resolutionunit"] = "NONE"
    metadata = None if kind == "plain" else {"axes": order + "YX", **keys}
    tifffile.imwrite(path, data, metadata=metadata, imagej=kind == "imagej", ome=kind == "ome", **options)
    full = [axis for axis in "CTZ" if axis not in order]
    wide = data.reshape([1] * len(full) + list(data.shape))
    wide = wide.transpose([("".join(full) + order + "YX").index(axis) for axis in "CTZYX"])
    path.with_suffix(".f64").write_bytes(np.ascontiguousarray(wide, dtype="<f8").tobytes())
    shape = [size[axis] for axis in "XYZ"]
    told = {"kind": kind, "order": order, "keys": str(keys), "options": str(options)}
    return {
        "file": path.name,
        "channels": size["C"],
        "times": size["T"],
        "shape": shape,
        "spacing": spacing,
        "unit": unit,
        **told,
    }


def main():
    seed, count, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    rng = np.random.default_rng(seed)
    for number in range(count):
        print(json.dumps(write(rng, folder / f"{number}.tif")))


if __name__ == "__main__":
    main()
