#!/usr/bin/env python3
"""Checks a store of several times, written by strandline, with other people's programs.

    check_series.py OUT.zarr STACK.tif FIRST END

The image and the labels must be arrays t, z, y, x as zarr-python reads them, valid by yaozarrs and ome-zarr-models,
and read as such by ome-zarr-py; the image must hold the times FIRST to END - 1 of STACK.tif, axes TZYX, as tifffile
reads it. Prints how many voxels of each label there are at each time, by numpy, as JSON.
"""

import json
import sys
from pathlib import Path

import numpy as np
import ome_zarr_models
import tifffile
import yaozarrs
import zarr
from ome_zarr.io import parse_url
from ome_zarr.reader import Reader


def main():
    store, stack = Path(sys.argv[1]), sys.argv[2]
    first, end = int(sys.argv[3]), int(sys.argv[4])
    image = zarr.open_array(store / "0", mode="r")
    labels = zarr.open_array(store / "labels/segmentation/0", mode="r")
    expected = tifffile.imread(stack)[first:end]
    assert image.shape == labels.shape == expected.shape, (image.shape, labels.shape, expected.shape)
    assert image.chunks[0] == 1 and image.dtype == expected.dtype
    assert np.array_equal(image[:], expected), "the image is not that of the stack"
    for group in (store, store / "labels/segmentation"):
        yaozarrs.validate_zarr_store(str(group))
        ome_zarr_models.open_ome_zarr(zarr.open_group(str(group), mode="r"))
        node = next(iter(Reader(parse_url(str(group)))()))
        assert [axis["name"] for axis in node.metadata["axes"]] == ["t", "z", "y", "x"], node.metadata["axes"]
        assert node.data[0].shape == expected.shape
        ome = zarr.open_group(str(group), mode="r").attrs
        ome = ome.get("ome", ome)
        for dataset in ome["multiscales"][0]["datasets"]:
            scale, translation = dataset["coordinateTransformations"]
            assert len(scale["scale"]) == len(translation["translation"]) == 4
            assert translation["translation"][0] == first * scale["scale"][0]
    counts = []
    for time in labels[:]:
        values, voxels = np.unique(time, return_counts=True)
        counts.append({str(value): int(n) for value, n in zip(values, voxels) if value})
    print(json.dumps(counts))


if __name__ == "__main__":
    main()
