"""scripts/check_formats: what strandline writes, read by other people's programs.

Volumes of every type go through `convert` into every format, and are read by tifffile, pynrrd, vtk, zarr-python and tensorstore: the same
numbers of the same type, spacing, origin and unit. A segmentation with `--ome 0.4` and `--ome 0.5` must pass ome-zarr-models and yaozarrs,
be read by ome-zarr-py, and be shown by the reader of napari-ome-zarr as an image with its window and labels with their colours; so must one
of several times, its arrays t, z, y, x with the same numbers for zarr-python and tensorstore. A mesh goes through VTP, which vtk reads.
With --large a volume of more than 4 GiB goes from NRRD to OME-Zarr 0.4, OME-TIFF and VTI within --memory.
Exit code 1 where anything is not as it must be.
"""

import argparse
import contextlib
import io
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from check_volume import Failure, check, require
from formats.series import check_series
from interrupting.runs import ball_marks, stack

SPACING, ORIGIN = [0.25, 0.3, 1.5], [10.5, -20.25, 7.0]
TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]
OUTPUTS = {"a.tif": [], "a.vti": [], "a.nrrd": [], "v5.zarr": ["--ome", "0.5"], "v4.zarr": ["--ome", "0.4"]}


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/check_formats", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--large", action="store_true", help="also a volume of more than 4 GiB (20 GiB of disk)")
    parser.add_argument("--memory", default="512MiB", help="memory of the large conversions (512MiB)")
    parser.add_argument("--folder", type=Path, help="where inputs and outputs are made [default: $TMPDIR]")
    return parser.parse_args()


def run(*arguments):
    subprocess.run([os.environ["STRANDLINE"], *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def nrrd_header(dtype, shape):
    names = {"f4": "float", "f8": "double"}
    x, y, z = SPACING
    return (
        f"NRRD0004\ntype: {names.get(dtype, np.dtype(dtype).name)}\ndimension: 3\nspace dimension: 3\n"
        f"sizes: {shape[2]} {shape[1]} {shape[0]}\nspace directions: ({x},0,0) (0,{y},0) (0,0,{z})\n"
        f"space origin: ({ORIGIN[0]},{ORIGIN[1]},{ORIGIN[2]})\n"
        'space units: "um" "um" "um"\nendian: little\nencoding: raw\n\n'
    ).encode()


def random_volume(dtype, shape, generator):
    kind = np.dtype(dtype)
    if kind.kind == "f":
        values = generator.standard_normal(shape).astype(kind)
        values[0, 0, :3] = np.nan, np.inf, -0.0
        return values
    limits = np.iinfo(kind)
    return generator.integers(limits.min, limits.max, shape, dtype=kind, endpoint=True)


def check_volumes(folder):
    generator = np.random.default_rng(1)
    for dtype in TYPES:
        values = random_volume(dtype, (37, 70, 131), generator)
        (folder / "in.nrrd").write_bytes(nrrd_header(dtype, values.shape) + values.tobytes())
        values.tofile(folder / "in.raw")
        expected = {
            "dtype": values.dtype.name, "shape": list(values.shape), "values": "in.raw",
            "spacing": SPACING, "origin": ORIGIN, "unit": "micrometer",
        }  # fmt: skip
        for name, flags in OUTPUTS.items():
            run("convert", folder / "in.nrrd", folder / name, "--overwrite", *flags)
            print(f"ok  {values.dtype.name} as {name}: {', '.join(check(folder / name, expected, folder))}")


def check_stores(folder):
    from napari_ome_zarr import napari_get_reader

    stack(folder / "stack.tif", 300, 40)
    ball_marks(folder / "marks.csv", (150, 150, 20), 18)
    checker = Path(os.environ["STRANDLINE_ROOT"]) / "scripts/check_store.py"
    for version in ("0.4", "0.5"):
        store = folder / f"s{version}.zarr"
        inputs = [folder / "stack.tif", "--points", folder / "marks.csv", "--image-spacing", "1,1,1"]
        run("segment", *inputs, "-q", "--ome", version, "-o", store)
        subprocess.run([sys.executable, checker, store], check=True)
        # It prints the attributes.
        with contextlib.redirect_stdout(io.StringIO()):
            layers = napari_get_reader(str(store))(str(store))
        kinds = [layer[2] for layer in layers]
        require(kinds == ["image", "labels"], f"napari's layers are {kinds}")
        (image, told, _), (labels, colored, _) = layers
        require(np.asarray(image[0]).shape == np.asarray(labels[0]).shape, "image and labels differ in shape")
        require(told["scale"] == [1.0, 1.0, 1.0] and len(told["contrast_limits"]) == 2, f"napari is told {told}")
        require(1 in colored["colormap"], "the labels have no colours")
        print(f"ok  OME-Zarr {version}: napari-ome-zarr")


def check_mesh(folder):
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    run("convert", folder / "s0.4.zarr/meshes/surface.ply", folder / "surface.vtp")
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "surface.vtp"))
    reader.Update()
    header = (folder / "s0.4.zarr/meshes/surface.ply").read_bytes()[:400].split(b"\n")
    counts = [int(line.split()[2]) for line in header if line.startswith(b"element")]
    found = [reader.GetOutput().GetNumberOfPoints(), reader.GetOutput().GetNumberOfPolys()]
    require(found == counts, f"vtk reads {found} points and triangles, not {counts}")
    print(f"ok  VTP: vtk, {found[0]} vertices, {found[1]} triangles")
    check_values(folder)


def check_values(folder):
    """Numbers of vertices, against all marks and points."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    def read(path):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        found = reader.GetOutput()
        values = found.GetPointData().GetScalars()
        require(found.GetNumberOfPoints() == values.GetNumberOfTuples() > 0, f"{path}: values of all points")
        return values.GetName(), vtk_to_numpy(found.GetPoints().GetData())[::7], vtk_to_numpy(values)[::7]

    def nearest(places, cloud):
        return np.array([np.linalg.norm(cloud - place, axis=1).min() for place in places.astype("f8")])

    stack, marks = folder / "stack.tif", folder / "marks.csv"
    run("segment", stack, "--points", marks, "--image-spacing", "1,1,1", "-q", "-o", "none", "--mesh", folder / "d.vtp")
    cloud = np.loadtxt(folder / "s0.5.zarr/marks.csv", delimiter=",", skiprows=1)[:, -3:]
    name, places, values = read(folder / "d.vtp")
    require(name == "distance_to_marks", f"values are called {name}")
    require(np.abs(values - nearest(places, cloud)).max() < 1e-4, "distances to the marks")
    sets = [np.random.default_rng(n).random((50, 3)) + [1.5 * n, 0, 0] for n in range(2)]
    for n, points in enumerate(sets):
        np.savetxt(folder / f"set{n}.xyz", points)
    run("middle", *(folder / f"set{n}.xyz" for n in range(2)), "--spacing", "0.05", "-q", "-o", "none", "--mesh", folder / "t.vtp")
    name, places, values = read(folder / "t.vtp")
    require(name == "thickness", f"values are called {name}")
    require(np.abs(values - nearest(places, sets[0]) - nearest(places, sets[1])).max() < 1e-4, "thickness")
    print("ok  VTP: vtk, distances to the marks, thickness")


def check_large(folder, memory):
    """More than 2^30 voxels, so that chunks of OME-Zarr 0.4 are laid together, and more than 4 GiB."""
    import tifffile
    import zarr

    shape, dtype = (1040, 1024, 1024), "f4"
    plane = np.random.default_rng(2).standard_normal(shape[1:]).astype(dtype).round(1)
    with (folder / "large.nrrd").open("wb") as file:
        file.write(nrrd_header(dtype, shape))
        for z in range(shape[0]):
            file.write((plane + np.float32(z)).tobytes())
    planes = [0, 63, 64, 511, 1039]
    for name, flags in {"large.zarr": ["--ome", "0.4"], "large.tif": ["--compress", "none"], "large.vti": []}.items():
        begun = time.monotonic()
        run("convert", folder / "large.nrrd", folder / name, "--memory", memory, "-q", *flags)
        seconds, most = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss // 1024
        if name == "large.zarr":
            array = zarr.open_array(folder / name / "0", mode="r")
            require(array.chunks == (128, 128, 128), f"chunks of {array.chunks}")
            found = {z: array[z] for z in planes}
        elif name == "large.tif":
            with tifffile.TiffFile(folder / name) as file:
                require(file.is_bigtiff and len(file.pages) == shape[0], "no BigTIFF of all planes")
                found = {z: file.pages[z].asarray() for z in planes}
        else:
            data = np.memmap(folder / name, dtype, "r", offset_of(folder / name), shape)
            found = {z: data[z] for z in planes}
        require(all(np.array_equal(found[z], plane + np.float32(z)) for z in planes), f"{name} holds other values")
        print(f"ok  {name}: {seconds:.0f} s, {most} MiB resident with --memory {memory}")


def offset_of(path):
    """Where the numbers of a VTI file begin: behind the underscore and their length."""
    with path.open("rb") as file:
        return file.read(4096).index(b"\n_") + 10


def main():
    settings = arguments()
    with tempfile.TemporaryDirectory(dir=settings.folder) as place:
        place = Path(place)
        try:
            check_volumes(place)
            check_stores(place)
            check_mesh(place)
            check_series(place, run)
            if settings.large:
                check_large(place, settings.memory)
        except Failure as failure:
            sys.exit(f"{failure}")


if __name__ == "__main__":
    main()
