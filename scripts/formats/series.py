"""Stores with an axis of time, read by other people's programs."""

import contextlib
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import tensorstore
import tifffile
import zarr

from check_volume import require

TIMES, SHAPE, RADIUS, MINUTES = 3, (24, 60, 70), 8.0, 2.5


def centre(time):
    return np.array([11.0 + time, 28.0, 26.0 + 4 * time])


def write_inputs(folder):
    """A ball that moves, over noise, and marks on it at the first and the last time."""
    places = np.stack(np.meshgrid(*map(np.arange, SHAPE), indexing="ij"), axis=-1)
    generator = np.random.default_rng(4)
    volumes = []
    for time in range(TIMES):
        inside = np.linalg.norm(places - centre(time), axis=-1) <= RADIUS
        volumes.append(100 + 300 * inside + generator.integers(0, 40, SHAPE))
    values = np.array(volumes, "u2")[:, :, None]
    about = {"axes": "TZCYX", "spacing": 1, "unit": "um", "finterval": MINUTES, "tunit": "min"}
    tifffile.imwrite(folder / "series.tif", values, imagej=True, resolution=(1, 1), metadata=about)
    with (folder / "series.csv").open("w") as file:
        file.write("object,contour,t,x,y,z\n")
        for time in (0, TIMES - 1):
            z0, y0, x0 = centre(time)
            for z in range(int(z0) - 6, int(z0) + 7, 2):
                radius = np.sqrt(RADIUS**2 - (z - z0) ** 2)
                for turn in np.arange(24) * np.pi / 12:
                    file.write(f"1,{z},{time},{x0 + radius * np.cos(turn)},{y0 + radius * np.sin(turn)},{z}\n")
    return values[:, :, 0]


def check_series(folder, run):
    """Image and labels as arrays t, z, y, x for zarr-python, tensorstore, ome-zarr-models, yaozarrs, ome-zarr-py and napari."""
    values = write_inputs(folder)
    checker = Path(os.environ["STRANDLINE_ROOT"]) / "scripts/check_series.py"
    for version in ("0.4", "0.5"):
        store = folder / f"t{version}.zarr"
        run(
            "segment",
            folder / "series.tif",
            "--points",
            folder / "series.csv",
            "--time",
            "all",
            "-q",
            "--ome",
            version,
            "-o",
            store,
        )
        command = [sys.executable, checker, store, folder / "series.tif", "0", str(TIMES)]
        counts = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
        ball = 4 / 3 * np.pi * RADIUS**3
        require(all(abs(count["1"] / ball - 1) < 0.1 for count in counts), f"voxels of the ball at each time: {counts}")
        driver = "zarr" if version == "0.4" else "zarr3"
        for group in ("", "labels/segmentation/"):
            spec = {"driver": driver, "kvstore": {"driver": "file", "path": f"{store / group / '0'}/"}}
            found = tensorstore.open(spec, read=True).result()
            require(
                np.array_equal(found.read().result(), zarr.open_array(store / group / "0", mode="r")[:]),
                f"{group}: tensorstore",
            )
            if version == "0.5":
                require(
                    found.domain.labels == ("t", "z", "y", "x"), f"{group}: tensorstore names {found.domain.labels}"
                )
        check_napari(store, values)
        print(
            f"ok  OME-Zarr {version} over time: zarr-python, tensorstore, ome-zarr-models, yaozarrs, ome-zarr-py, napari-ome-zarr"
        )


def check_napari(store, values):
    from napari_ome_zarr import napari_get_reader

    # It prints the attributes.
    with contextlib.redirect_stdout(io.StringIO()):
        (image, told, _), (labels, colored, _) = napari_get_reader(str(store))(str(store))
    require(np.array_equal(np.asarray(image[0]), values), "napari's image is another")
    require(np.asarray(labels[0]).shape == values.shape, "image and labels differ in shape")
    require(
        told["scale"] == colored["scale"] == [MINUTES, 1.0, 1.0, 1.0],
        f"napari is told the scales {told['scale']}, {colored['scale']}",
    )
    require(1 in colored["colormap"], "the labels have no colours")
