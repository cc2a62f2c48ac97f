#!/usr/bin/env python3
"""Writes random OME-Zarr images in random dialects with zarr-python, each with what a reader must make of it.

    write_zarr.py FOLDER SEED COUNT

makes FOLDER/N/image.zarr, FOLDER/N/values.raw (little-endian f64, z, y, x) and FOLDER/N/expect.json for N below COUNT.
"""

import json
import random
import sys
from pathlib import Path

import numcodecs
import numpy as np
import zarr
import zarr.codecs as codecs

TYPES = ["bool", "u1", "u2", "u4", "u8", "i1", "i2", "i4", "i8", "f2", "f4", "f8"]


def content(rng: random.Random, dtype: str, shape: list[int]) -> np.ndarray:
    """Values that fill the type's range, but for 64 bits, of which 53 are exact."""
    values = np.random.default_rng(rng.randrange(1 << 30))
    if dtype == "bool":
        return values.integers(0, 2, shape).astype(bool)
    if dtype.startswith("f"):
        return values.normal(size=shape).astype(dtype)
    info = np.iinfo(dtype)
    low, high = max(int(info.min), -(1 << 53)), min(int(info.max), 1 << 53)
    return values.integers(low, high, shape, endpoint=True).astype(dtype)


def write_v3(rng: random.Random, path: Path, array: np.ndarray, fill) -> None:
    shape = array.shape
    chunks = [rng.randint(1, min(n, 9)) for n in shape]
    kinds = [
        None,
        codecs.GzipCodec(level=rng.randint(0, 9)),
        codecs.ZstdCodec(level=rng.randint(0, 5), checksum=rng.random() < 0.5),
        codecs.BloscCodec(cname=rng.choice(["lz4", "zstd", "zlib", "blosclz"]), shuffle=rng.choice(["shuffle", "noshuffle", "bitshuffle"])),
    ]
    compressors = [c for c in [rng.choice(kinds)] if c]
    if rng.random() < 0.3:
        compressors.append(codecs.Crc32cCodec())
    filters = []
    if rng.random() < 0.3:
        order = list(range(len(shape)))
        rng.shuffle(order)
        filters.append(codecs.TransposeCodec(order=order))
    shards = [c * rng.randint(1, 3) for c in chunks] if rng.random() < 0.4 else None
    created = zarr.create_array(
        store=path, shape=shape, chunks=chunks, shards=shards, dtype=array.dtype, fill_value=fill, filters=filters,
        compressors=compressors, serializer=codecs.BytesCodec(endian=rng.choice(["little", "big"])), zarr_format=3,
        config={"write_empty_chunks": rng.random() < 0.5},
    )
    created[...] = array


def write_v2(rng: random.Random, path: Path, array: np.ndarray, fill) -> None:
    chunks = [rng.randint(1, min(n, 9)) for n in array.shape]
    kinds = [
        None, numcodecs.GZip(rng.randint(1, 9)), numcodecs.Zlib(rng.randint(0, 9)), numcodecs.BZ2(rng.randint(1, 9)),
        numcodecs.Zstd(rng.randint(1, 5)), numcodecs.Blosc(cname=rng.choice(["lz4", "zstd", "zlib"]), shuffle=rng.choice([0, 1, 2])),
    ]
    created = zarr.create_array(
        store=path, shape=array.shape, chunks=chunks, dtype=array.dtype.newbyteorder(rng.choice("<>")),
        fill_value=fill, compressors=rng.choice(kinds), order=rng.choice("CF"), zarr_format=2,
        chunk_key_encoding={"name": "v2", "separator": rng.choice("./")}, config={"write_empty_chunks": rng.random() < 0.5},
    )
    created[...] = array


def write(rng: random.Random, folder: Path) -> None:
    spatial = {axis: rng.randint(2, 20) for axis in "zyx"}
    extra = {axis: rng.randint(1, 3) for axis in rng.choice(["", "t", "c", "tc"])}
    axes = list(extra) + list(spatial)
    if rng.random() < 0.5:
        rng.shuffle(axes)
    sizes = spatial | extra
    array = content(rng, rng.choice(TYPES), [sizes[axis] for axis in axes])
    fill = array.flat[0].item()
    # Some chunks hold nothing but the fill value and are perhaps not stored.
    array[tuple(slice(0, max(1, n // 2)) for n in array.shape)] = fill
    version = rng.choice(["0.4", "0.5"])
    # The types are plain, so that nothing but a scale and a translation is rounded.
    scale = {axis: rng.choice([0.25, 0.5, 1.0, 2.0]) for axis in axes}
    shift = {axis: rng.choice([0.0, -3.5, 1000.0]) for axis in axes}
    common = {axis: rng.choice([0.5, 1.0, 4.0]) for axis in axes}
    nanometres = rng.choice("zyx") if rng.random() < 0.4 else None
    units = {axis: "nanometer" if axis == nanometres else "micrometer" for axis in "zyx"}
    kinds = {"t": "time", "c": "channel"}
    named = [{"name": axis, "type": kinds.get(axis, "space")} | ({"unit": units[axis]} if axis in units else {}) for axis in axes]
    own = [{"type": "scale", "scale": [scale[a] for a in axes]}]
    translated = rng.random() < 0.5
    if translated:
        own.append({"type": "translation", "translation": [shift[a] for a in axes]})
    levels = rng.randint(1, 3)
    level = rng.randrange(levels)
    multiscale = {
        "version": version, "axes": named,
        "datasets": [{"path": f"s{n}", "coordinateTransformations": own} for n in range(levels)],
    }
    doubled = rng.random() < 0.5
    if doubled:
        multiscale["coordinateTransformations"] = [{"type": "scale", "scale": [common[a] for a in axes]}]
    attributes = {"multiscales": [multiscale]}
    if version == "0.5":
        attributes = {"ome": attributes | {"version": "0.5"}}
    path = folder / "image.zarr"
    zarr.create_group(store=path, zarr_format=3 if version == "0.5" else 2, attributes=attributes)
    (write_v3 if version == "0.5" else write_v2)(rng, path / f"s{level}", array, fill)
    chosen = {axis: rng.randrange(extra.get(axis, 1)) for axis in "tc"}
    part = array[tuple(chosen[axis] if axis in extra else slice(None) for axis in axes)]
    left = [axis for axis in axes if axis in spatial]
    part = part.transpose([left.index(axis) for axis in "zyx"])
    part.astype("<f8").tofile(folder / "values.raw")
    # The common unit is that of x, y, z in this order.
    unit = units["x"]
    to_unit = {axis: (1.0 if units[axis] == unit else 1000.0 if unit == "nanometer" else 0.001) for axis in "xyz"}
    factor = {axis: common[axis] if doubled else 1.0 for axis in "xyz"}
    expect = {
        "shape_xyz": [sizes[a] for a in "xyz"],
        "spacing_xyz": [scale[a] * factor[a] * to_unit[a] for a in "xyz"],
        "origin_xyz": [(shift[a] if translated else 0.0) * factor[a] * to_unit[a] for a in "xyz"],
        "unit": unit, "channel": chosen["c"], "time": chosen["t"], "level": level,
        "channels": extra.get("c", 1), "times": extra.get("t", 1),
    }
    (folder / "expect.json").write_text(json.dumps(expect))


def main() -> None:
    root, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    for number in range(count):
        folder = root / str(number)
        folder.mkdir(parents=True)
        write(random.Random(f"{seed} {number}"), folder)


if __name__ == "__main__":
    main()
