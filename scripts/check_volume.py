#!/usr/bin/env python3
"""Checks volumes written by strandline with other people's programs.

    check_volume.py EXPECT.json FILE... [EXPECT.json FILE...]

Each file, which must hold what the document before it says, is read by every reader of its kind that is installed (tifffile,
pynrrd, vtk, zarr-python, tensorstore): the same numbers of the same type, as far apart in the same unit, from the same place on.
    {"dtype": "uint16", "shape": [z, y, x], "values": "FILE.raw", "spacing": [x, y, z], "origin": [x, y, z],
     "unit": "micrometer"}
FILE.raw, relative to EXPECT.json, holds the voxels as little-endian numbers. Keys other than dtype, shape and values are
optional. Prints a line for each reading.
"""

import importlib.util
import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

SYMBOLS = {"micrometer": ("µm", "um"), "nanometer": ("nm", "nm"), "millimeter": ("mm", "mm")}


class Failure(Exception):
    """Something in a file is not as it must be."""


def require(condition, message):
    if not condition:
        raise Failure(message)


def by_tifffile(path, expected):
    import tifffile

    with tifffile.TiffFile(path) as file:
        require(file.is_ome, "tifffile takes it for no OME-TIFF")
        values = file.series[0].asarray()
        require(file.series[0].axes in ("ZYX", "YX"), f"axes are {file.series[0].axes}")
        root = ElementTree.fromstring(file.ome_metadata)
    pixels = root.find(".//{*}Pixels")
    spacing = [float(pixels.get(f"PhysicalSize{axis}", "nan")) for axis in "XYZ"]
    units = {pixels.get(f"PhysicalSize{axis}Unit") for axis in "XYZ"}
    if "unit" in expected:
        require(units == {SYMBOLS[expected["unit"]][0]}, f"units are {units}")
    return values.reshape(expected["shape"]), spacing, None


def by_pynrrd(path, expected):
    import nrrd

    values, header = nrrd.read(str(path), index_order="C")
    directions = header["space directions"]
    require(np.count_nonzero(directions - np.diag(np.diagonal(directions))) == 0, "axes are turned")
    if "unit" in expected:
        require(header["space units"] == [SYMBOLS[expected["unit"]][1]] * 3, f"units are {header['space units']}")
    return values, np.diagonal(directions), header["space origin"]


def by_vtk(path, expected):
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    require(reader.GetErrorCode() == 0, f"vtk ends with error {reader.GetErrorCode()}")
    image = reader.GetOutput()
    require(list(image.GetDimensions()) == expected["shape"][::-1], f"vtk reads {image.GetDimensions()}")
    values = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(expected["shape"])
    if "unit" in expected:
        unit = image.GetFieldData().GetAbstractArray("LengthUnit").GetValue(0)
        require(unit == expected["unit"], f"the unit is {unit}")
    return values, image.GetSpacing(), image.GetOrigin()


def described(path, expected):
    """Spacing and origin of the finest level, by the attributes of either version."""
    import zarr

    attributes = zarr.open_group(path, mode="r").attrs.asdict()
    multiscale = attributes.get("ome", attributes)["multiscales"][0]
    scale, translation = multiscale["datasets"][0]["coordinateTransformations"]
    if "unit" in expected:
        units = [axis.get("unit") for axis in multiscale["axes"]]
        require(units == [expected["unit"]] * 3, f"units are {units}")
    return scale["scale"][::-1], translation["translation"][::-1]


def by_zarr(path, expected):
    import zarr

    return zarr.open_array(path / "0", mode="r")[...], *described(path, expected)


def by_tensorstore(path, expected):
    import tensorstore

    driver = "zarr3" if (path / "zarr.json").exists() else "zarr"
    spec = {"driver": driver, "kvstore": {"driver": "file", "path": f"{path}/0"}}
    return tensorstore.open(spec).result().read().result(), *described(path, expected)


READERS = {
    ".tif": {"tifffile": by_tifffile},
    ".nrrd": {"nrrd": by_pynrrd},
    ".vti": {"vtkmodules": by_vtk},
    ".zarr": {"zarr": by_zarr, "tensorstore": by_tensorstore},
}


def check(path, expected, folder):
    """Checks a file; returns the names of the readers that found it right."""
    raw = np.fromfile(folder / expected["values"], np.dtype(expected["dtype"]).newbyteorder("<"))
    raw = raw.reshape(expected["shape"])
    passed = []
    for module, read in READERS[path.suffix].items():
        if importlib.util.find_spec(module) is None:
            continue
        values, spacing, origin = read(path, expected)
        require(values.dtype == np.dtype(expected["dtype"]), f"{module} reads {values.dtype}")
        require(values.shape == raw.shape, f"{module} reads a volume of {values.shape}")
        same = np.array_equal(values, raw, equal_nan=raw.dtype.kind == "f")
        require(same, f"{module} reads other values")
        for told, found in (("spacing", spacing), ("origin", origin)):
            if told in expected and found is not None:
                require(list(found) == expected[told], f"{module} reads the {told} {list(found)}")
        passed.append(module)
    return passed


def main():
    for path in map(Path, sys.argv[1:]):
        if path.suffix == ".json":
            expect, expected = path, json.loads(path.read_text())
            continue
        try:
            for module in check(path, expected, expect.parent):
                print(f"ok  {path.name}: {module}")
        except Failure as failure:
            sys.exit(f"{path}: {failure}")


if __name__ == "__main__":
    main()
