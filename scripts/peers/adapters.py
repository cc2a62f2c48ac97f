"""How each program is called.

`prepare` brings the input into the program's own form and is not timed; what it returns is. The sign of a distance is
left to whoever compares. The programs' modules are imported where they are used: no environment has all of them.

Input of a case on a grid: `mask` (True at sources) and `spacing`; arrays are `[z, y, x]`. Input of a mesh case:
`vertices`, `faces`, `shape`, `spacing`, `origin`, of which `shape` and `origin` are x, y, z.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Peer:
    """One program and method."""

    program: str  # the package's name
    method: str
    prepare: Callable  # (case, threads) -> function without arguments that returns the distances
    group: str = "numpy2"
    threads: tuple = (1,)
    note: str = ""
    band: float | None = None  # voxels around the surface that get a distance; None: all


def edt(case, threads):
    import edt

    far = ~case["mask"]
    return lambda: edt.edt(far, anisotropy=(case["spacing"],) * 3, parallel=threads)


def scipy_edt(case, threads):
    from scipy import ndimage

    far = ~case["mask"]
    return lambda: ndimage.distance_transform_edt(far, sampling=case["spacing"])


def scipy_indices(case, threads):
    from scipy import ndimage

    far = ~case["mask"]
    return lambda: ndimage.distance_transform_edt(far, sampling=case["spacing"], return_indices=True)[0]


def bioimage_edt(case, threads):
    from bioimage_cpp import distance

    far = ~case["mask"]
    return lambda: distance.distance_transform(far, sampling=case["spacing"], number_of_threads=threads)


def bioimage_indices(case, threads):
    from bioimage_cpp import distance

    far = ~case["mask"]
    settings = {"sampling": case["spacing"], "number_of_threads": threads, "return_indices": True}
    return lambda: distance.distance_transform(far, **settings)[0]


def bioimage_geodesic(case, threads):
    from bioimage_cpp import distance

    everywhere = np.ones(case["mask"].shape, dtype=np.uint8)
    sources = np.argwhere(case["mask"])
    return lambda: distance.geodesic_distance_field(everywhere, sources, sampling=case["spacing"])


def itk_image(array, spacing):
    import itk

    image = itk.image_from_array(array)
    image.SetSpacing([spacing] * 3)
    return image


def itk_maurer(case, threads):
    import itk

    itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(threads)
    image = itk_image(case["mask"].astype(np.uint8), case["spacing"])

    def run():
        field = itk.signed_maurer_distance_map_image_filter(image, squared_distance=False, use_image_spacing=True)
        return itk.array_view_from_image(field)

    return run


def itk_fast_marching(case, threads):
    import itk

    itk.MultiThreaderBase.SetGlobalDefaultNumberOfThreads(threads)
    image_type = itk.Image[itk.F, 3]
    nodes = itk.VectorContainer[itk.UI, itk.LevelSetNode[itk.F, 3]].New()
    points = np.argwhere(case["mask"])[:, ::-1].tolist()
    nodes.Reserve(len(points))
    for number, index in enumerate(points):
        node = itk.LevelSetNode[itk.F, 3]()
        node.SetValue(0.0)
        node.SetIndex(index)
        nodes.SetElement(number, node)
    marching = itk.FastMarchingImageFilter[image_type, image_type].New()
    marching.SetTrialPoints(nodes)
    marching.SetSpeedConstant(1.0)
    marching.SetOutputSize(case["mask"].shape[::-1])
    marching.SetOutputSpacing([case["spacing"]] * 3)

    def run():
        marching.Modified()  # or a second call would find the field there
        marching.Update()
        return itk.array_view_from_image(marching.GetOutput())

    return run


def skfmm(order):
    def prepare(case, threads):
        import skfmm

        start = np.where(case["mask"], 0.0, 1.0)
        return lambda: np.asarray(skfmm.distance(start, dx=case["spacing"], order=order))

    return prepare


def pyfmm(sweeping):
    def prepare(case, threads):
        import pyfmm

        # Zero means "not set" there; sources are given a distance far below rounding instead.
        start = np.where(case["mask"], 1e-12, 0.0)
        axes = [np.arange(n) * case["spacing"] for n in start.shape]
        slowness = np.ones(start.shape)
        pyfmm.set_fsm_num_threads(threads)
        parallel = {"FSMparallel": threads > 1, "FSMmaxLoops": 2 if threads > 1 else 1} if sweeping else {}
        return lambda: pyfmm.travel_time_iniTT(start, *axes, slowness, maxodr=1, useFSM=sweeping, **parallel)

    return prepare


def openvdb(half_width):
    """Signed; `half_width` voxels to both sides, None: as wide as the grid."""

    def prepare(case, threads):
        try:
            import openvdb as vdb
        except ImportError:
            import pyopenvdb as vdb
        h, shape, origin = float(case["spacing"]), [int(n) for n in case["shape"]], case["origin"]
        transform = vdb.createLinearTransform(h)
        points = case["vertices"] - origin
        faces = case["faces"].astype(np.uint32)
        width = half_width or float(np.linalg.norm(shape))

        def run():
            grid = vdb.FloatGrid.createLevelSetFromPolygons(
                points, triangles=faces, transform=transform, halfWidth=width
            )
            field = np.empty(shape, dtype=np.float32)
            grid.copyToArray(field)
            return field.T

        return run

    return prepare


GRID_PEERS = (
    Peer("edt", "exact transform", edt, threads=(1, 2)),
    Peer("bioimage-cpp", "exact transform", bioimage_edt, threads=(1, 2)),
    Peer("bioimage-cpp", "exact transform, indices", bioimage_indices, threads=(1, 2), note="keeps the nearest source"),
    Peer("itk", "Maurer", itk_maurer, threads=(1, 2)),
    Peer("scipy", "exact transform", scipy_edt),
    Peer("scipy", "exact transform, indices", scipy_indices, note="keeps the nearest source"),
    Peer("itk", "fast marching", itk_fast_marching),
    Peer("scikit-fmm", "fast marching", skfmm(1)),
    Peer("scikit-fmm", "fast marching, order 2", skfmm(2)),
    Peer("bioimage-cpp", "fast marching", bioimage_geodesic),
    Peer("pyfmm-kit", "fast marching", pyfmm(False), group="numpy1"),
    Peer(
        "pyfmm-kit",
        "fast sweeping",
        pyfmm(True),
        group="numpy1",
        threads=(1, 2),
        note="two iterations with 2 threads, its least",
    ),
)
MESH_PEERS = (
    Peer("openvdb", "band of 3 voxels", openvdb(3.0), threads=(1, 2), band=3.0, note="signed"),
    Peer("openvdb", "whole grid", openvdb(None), note="signed"),
)
