#!/usr/bin/env python3
"""Checks a store written by strandline with other people's programs.

    check_store.py OUT.zarr [--expect EXPECT.json]

Every multiscale in the store is read with zarr-python: its levels must follow from each other (numpy's own mean of each
block for images, the most frequent value for labels), and so must their scales and translations. The store must pass
yaozarrs and ome-zarr-models, and ome-zarr-py must read values, scales and translations as they are stored. Stores are of
OME-Zarr 0.4 or 0.5; all of one store is of the same version.

EXPECT.json says what the finest level must hold, by group ("" is the root), all keys optional:
    {"labels/cells": {"dtype": "uint8", "shape": [z, y, x], "values": "FILE.raw", "scale": [z, y, x],
                      "translation": [z, y, x], "unit": "micrometer"}}
FILE.raw, relative to EXPECT.json, holds the voxels as little-endian numbers. Groups it does not name are checked too;
groups it names must exist.
"""

import argparse
import json
import sys
import warnings
from pathlib import Path

import numpy as np
import ome_zarr_models
import yaozarrs
import zarr
from ome_zarr.io import parse_url
from ome_zarr.reader import Reader

COARSEST_EXTENT = 256


class Failure(Exception):
    """Something in the store is not as it must be."""


def require(condition, message):
    if not condition:
        raise Failure(message)


def metadata_of(folder):
    """The document of a group or an array, that of OME-Zarr 0.4 in the form of 0.5."""
    path = folder / "zarr.json"
    if path.is_file():
        return json.loads(path.read_text())
    kind = next((kind for kind in ("group", "array") if (folder / f".z{kind}").is_file()), None)
    require(kind, f"{folder} has no zarr.json, .zgroup or .zarray")
    document = json.loads((folder / f".z{kind}").read_text())
    attributes = folder / ".zattrs"
    ome = json.loads(attributes.read_text()) if attributes.is_file() else {}
    versions = {described.get("version") for described in ome.get("multiscales", [])}
    return document | {"node_type": kind, "attributes": {"ome": ome | {"version": "".join(versions)}} if ome else {}}


def version_of(store):
    return "0.5" if (store / "zarr.json").is_file() else "0.4"


def multiscales_in(store):
    """All groups with a multiscale, as paths relative to the store; checks the groups on the way."""
    found = []
    version = version_of(store)
    names = ["zarr.json"] if version == "0.5" else [".zgroup", ".zarray"]
    for path in sorted(path for name in names for path in store.rglob(name)):
        document = metadata_of(path.parent)
        format = 3 if version == "0.5" else 2
        require(document["zarr_format"] == format, f"{path} is not Zarr version {format}")
        require("_zarrs" not in document.get("attributes", {}), f"{path} carries a library's private attribute")
        relative = path.parent.relative_to(store)
        for parent in relative.parents:
            require(metadata_of(store / parent)["node_type"] == "group", f"{parent} above {relative} is no group")
        if "multiscales" in document.get("attributes", {}).get("ome", {}):
            found.append("" if str(relative) == "." else str(relative))
    require(found, "there is no multiscale in the store")
    return found


def transforms_of(dataset):
    scale, translation = dataset["coordinateTransformations"]
    require([scale["type"], translation["type"]] == ["scale", "translation"], "scale and translation are out of order")
    return np.array(scale["scale"]), np.array(translation["translation"])


def blocks(values, factors):
    """The values of each block along a last axis, and which of them exist."""
    padding = [(0, -n % f) for n, f in zip(values.shape, factors)]
    exists = np.pad(np.ones(values.shape, bool), padding)
    split = [size for n, (_, extra), f in zip(values.shape, padding, factors) for size in ((n + extra) // f, f)]
    gather = lambda a: a.reshape(split).transpose(0, 2, 4, 1, 3, 5).reshape(*split[::2], -1)  # noqa: E731
    return gather(np.pad(values, padding)), gather(exists)


def block_mean(values, factors):
    block, exists = blocks(values, factors)
    count = exists.sum(-1)
    if values.dtype.kind == "u":
        total = np.where(exists, block, 0).sum(-1, dtype=np.uint64)
        return ((2 * total + count.astype(np.uint64)) // (2 * count.astype(np.uint64))).astype(values.dtype)
    return (np.where(exists, block, 0).sum(-1, dtype=np.float64) / count).astype(values.dtype)


def block_mode(values, factors):
    block, exists = blocks(values, factors)
    votes = np.stack(
        [((block == block[..., k, None]) & exists).sum(-1) * exists[..., k] for k in range(block.shape[-1])], -1
    )
    leads = votes == votes.max(-1, keepdims=True)
    largest = np.iinfo(values.dtype).max
    label = np.where(leads & (block != 0), block, largest).min(-1)
    return np.where((leads & (block != 0)).any(-1), label, 0).astype(values.dtype)


def same(found, expected):
    if expected.dtype.kind == "f":
        return np.allclose(found, expected, rtol=4 * np.finfo(expected.dtype).eps, atol=0, equal_nan=True)
    return np.array_equal(found, expected)


def check_array(folder, array):
    document = metadata_of(folder)
    if document["zarr_format"] == 2:
        require(document["dimension_separator"] == "/", f"{folder}: chunks do not lie in folders")
    else:
        require(document["dimension_names"] == ["z", "y", "x"], f"{folder}: dimension names are not z, y, x")
        require(array.shards is not None, f"{folder} is not sharded")
        require(all(s % c == 0 for s, c in zip(array.shards, array.chunks)), f"{folder}: chunks do not fill a shard")
    documents = [".zarray", ".zattrs"]
    leftovers = [path for path in folder.rglob("*") if path.name.startswith(".") and path.name not in documents]
    require(not leftovers, f"{folder}: unfinished files {leftovers}")


def check_levels(store, group, ome):
    """Checks arrays, values, scales and translations of all levels; returns the levels' values."""
    multiscale = ome["multiscales"][0]
    is_label = "image-label" in ome
    require([axis["name"] for axis in multiscale["axes"]] == ["z", "y", "x"], f"{group}: axes are not z, y, x")
    levels = []
    before = None
    for dataset in multiscale["datasets"]:
        folder = store / group / dataset["path"]
        array = zarr.open_array(folder, mode="r")
        check_array(folder, array)
        scale, translation = transforms_of(dataset)
        values = array[...]
        if before is not None:
            factors = np.rint(scale / before[0]).astype(int)
            require(set(factors) <= {1, 2} and 2 in factors, f"{group}: factors {factors}")
            require(np.allclose(scale, before[0] * factors, rtol=1e-12), f"{group}: scale {scale}")
            moved = before[1] + (factors - 1) / 2 * before[0]
            require(np.allclose(translation, moved, rtol=1e-12, atol=1e-12 * scale.max()), f"{group}: {translation}")
            reduce = block_mode if is_label else block_mean
            expected = reduce(levels[-1], factors)
            require(values.shape == expected.shape, f"{folder}: shape {values.shape}, not {expected.shape}")
            require(same(values, expected), f"{folder}: the values do not follow from the level before")
        levels.append(values)
        before = (scale, translation)
    require(max(levels[-1].shape) <= COARSEST_EXTENT, f"{group}: the coarsest level is {levels[-1].shape}")
    return levels


def check_label(store, group, ome, values):
    require(values.dtype.kind == "u", f"{group}: labels are {values.dtype}")
    listed = metadata_of((store / group).parent)["attributes"]["ome"]["labels"]
    require(Path(group).name in listed, f"{group} is not listed among the labels {listed}")
    image = (store / group / ome["image-label"]["source"]["image"]).resolve()
    require("multiscales" in metadata_of(image)["attributes"]["ome"], f"{group}: its source {image} is no image")


def check_with_models(store, group):
    opened = ome_zarr_models.open_ome_zarr(zarr.open_group(store / group, mode="r"), version=version_of(store))
    kind = type(opened).__name__
    is_label = "image-label" in metadata_of(store / group)["attributes"]["ome"]
    allowed = ["ImageLabel"] if is_label else ["Image"]
    require(kind in allowed, f"{group}: ome-zarr-models takes it for {kind}")


def check_with_ome_zarr_py(store, group, ome, levels):
    location = parse_url(store / group, mode="r")
    require(location is not None, f"{group}: ome-zarr-py cannot open it")
    node = next(node for node in Reader(location)() if Path(node.zarr.path) == store / group)
    require(len(node.data) == len(levels), f"{group}: ome-zarr-py finds {len(node.data)} levels")
    for data, values in zip(node.data, levels):
        require(np.array_equal(np.asarray(data), values, equal_nan=True), f"{group}: ome-zarr-py reads other values")
    stored = [dataset["coordinateTransformations"] for dataset in ome["multiscales"][0]["datasets"]]
    require(node.metadata["coordinateTransformations"] == stored, f"{group}: ome-zarr-py reads other transformations")
    if colors := ome.get("image-label", {}).get("colors"):
        read = {label: rgba for label, rgba in node.metadata["color"].items()}
        expected = {color["label-value"]: [c / 255 for c in color["rgba"]] for color in colors}
        require(
            read.keys() == expected.keys() and all(np.allclose(read[k], expected[k]) for k in read),
            f"{group}: ome-zarr-py reads other colours",
        )


def check_expected(group, ome, values, expected, folder):
    scale, translation = transforms_of(ome["multiscales"][0]["datasets"][0])
    found = {
        "dtype": str(values.dtype),
        "shape": list(values.shape),
        "scale": scale.tolist(),
        "translation": translation.tolist(),
    }
    for key in expected.keys() & found.keys():
        require(found[key] == expected[key], f"{group}: {key} is {found[key]}, not {expected[key]}")
    if "unit" in expected:
        units = [axis.get("unit") for axis in ome["multiscales"][0]["axes"]]
        require(units == [expected["unit"]] * 3, f"{group}: units are {units}")
    if "values" in expected:
        raw = np.fromfile(folder / expected["values"], values.dtype.newbyteorder("<")).reshape(values.shape)
        require(np.array_equal(values, raw, equal_nan=True), f"{group}: the finest level holds other values")


def check_store(store, expect=None, folder=None):
    groups = multiscales_in(store)
    missing = (expect or {}).keys() - set(groups)
    require(not missing, f"no multiscale at {sorted(missing)}")
    for group in groups:
        ome = metadata_of(store / group)["attributes"]["ome"]
        require(ome["version"] == version_of(store), f"{group}: version {ome['version']}")
        levels = check_levels(store, group, ome)
        if "image-label" in ome and group:
            check_label(store, group, ome, levels[0])
        check_expected(group, ome, levels[0], (expect or {}).get(group, {}), folder)
        yaozarrs.validate_zarr_store(str(store / group))
        check_with_models(store, group)
        check_with_ome_zarr_py(store, group, ome, levels)
        shapes = " ".join("x".join(map(str, level.shape)) for level in levels)
        print(f"ok  {group or '(root)'}: {levels[0].dtype}, levels [z, y, x] {shapes}")
    if (store / "labels").is_dir():
        # The list of labels names no version in 0.4, so that alone it could be anything.
        if version_of(store) == "0.5":
            yaozarrs.validate_zarr_store(str(store / "labels"))
        ome_zarr_models.open_ome_zarr(zarr.open_group(store / "labels", mode="r"), version=version_of(store))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--expect", type=Path)
    arguments = parser.parse_args()
    # Files beside the arrays (meshes, report.json) are meant to be there.
    warnings.filterwarnings("ignore", message="Object at .* is not recognized")
    expect = json.loads(arguments.expect.read_text()) if arguments.expect else None
    folder = arguments.expect.parent if arguments.expect else None
    try:
        check_store(arguments.store.resolve(), expect, folder)
    except Failure as failure:
        sys.exit(f"{arguments.store}: {failure}")


if __name__ == "__main__":
    main()
