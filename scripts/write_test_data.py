"""Makes what of `tests/data` is made and not copied: `tiff-derived/` and the decimated whale.

    write_test_data.py MOUSE.tif WHALE.ply FOLDER

MOUSE.tif is `mouse-8cell-raw.tif` and WHALE.ply `pilot-whale-cranium.ply`, see `tests/data/README.md`. Runs with the packages of
`requirements-test.txt`. The files of tifffile differ from run to run in their OME UUIDs alone.
"""

import struct
import sys
from pathlib import Path

import igl
import numpy as np
import tifffile
import trimesh

# The brightest box of 8 x 40 x 40 voxels, of those at every third plane and every eighth pixel.
CROP = (slice(36, 44), slice(40, 80), slice(48, 88))
SPACING = {"PhysicalSizeX": 0.8, "PhysicalSizeY": 0.8, "PhysicalSizeZ": 1.744}
OME = SPACING | {f"{name}Unit": "\u00b5m" for name in SPACING}
RESOLUTION = {"resolution": (1 / 0.8, 1 / 0.8)}
IMAGEJ = {"imagej": True, "metadata": {"axes": "ZYX", "spacing": 1.744, "unit": "um"}, **RESOLUTION}


def write_ome(path, values, axes="ZYX", **options):
    options.setdefault("photometric", "minisblack")
    tifffile.imwrite(path, values, ome=True, metadata={"axes": axes, **OME}, **options)


def write_imagej(folder, truth):
    tifffile.imwrite(folder / "imagej_u8.tif", np.minimum(truth // 4, 255).astype(np.uint8), byteorder="<", **IMAGEJ)
    tifffile.imwrite(folder / "imagej_u16_be.tif", truth, byteorder=">", **IMAGEJ)
    tifffile.imwrite(folder / "imagej_f32.tif", truth.astype(np.float32), byteorder="<", **IMAGEJ)


def write_packed(folder, truth):
    for name, compression, predictor in [
        ("zlib", "zlib", None),
        ("zlib_pred2", "zlib", 2),
        ("lzw", "lzw", None),
        ("lzw_pred2", "lzw", 2),
        ("packbits", "packbits", None),
        ("zstd", "zstd", None),
        ("lzma", "lzma", None),
    ]:
        write_ome(folder / f"ome_u16_{name}.ome.tif", truth, compression=compression, predictor=predictor)
    write_ome(folder / "ome_f32_zlib_pred3.ome.tif", truth.astype(np.float32), compression="zlib", predictor=3)
    write_ome(folder / "ome_u16_tiled32_zlib.ome.tif", truth, compression="zlib", tile=(32, 32))
    write_ome(folder / "ome_u16_bigtiff_tiled_zstd.ome.tif", truth, compression="zstd", tile=(16, 16), bigtiff=True)


def write_types(folder, truth):
    write_ome(folder / "ome_i16.ome.tif", truth.astype(np.int16) - 500)
    write_ome(folder / "ome_u32.ome.tif", truth.astype(np.uint32) * 70_000, compression="zlib")
    write_ome(folder / "ome_f64.ome.tif", truth / 7.0, compression="zlib")
    for name, order in (("le", "<"), ("be", ">")):
        write_ome(folder / f"ome_u16_bigtiff_{name}.ome.tif", truth, bigtiff=True, byteorder=order)


def write_axes(folder, truth):
    """The second channel is the first one upside down in z."""
    both = np.stack([truth, truth[::-1]])
    write_ome(folder / "ome_u16_2ch_zcyx.ome.tif", both.transpose(1, 0, 2, 3), axes="ZCYX")
    write_ome(folder / "ome_u16_2ch_planar.ome.tif", both.transpose(1, 0, 2, 3), axes="ZSYX", planarconfig="separate")
    write_ome(folder / "ome_u16_2ch_contig.ome.tif", both.transpose(1, 2, 3, 0), axes="ZYXS", planarconfig="contig")
    write_ome(folder / "ome_u16_tczyx.ome.tif", np.stack([both, both]), axes="TCZYX")
    with tifffile.TiffWriter(folder / "ome_u16_pyramid_subifd.ome.tif", ome=True) as writer:
        options = {"tile": (32, 32), "photometric": "minisblack"}
        writer.write(truth, subifds=1, metadata={"axes": "ZYX", **OME}, **options)
        writer.write(truth[:, ::2, ::2], subfiletype=1, **options)


def write_plain(folder, truth):
    strips = {"byteorder": ">", "rowsperstrip": 7, "metadata": None, "photometric": "minisblack"}
    tifffile.imwrite(folder / "plain_multipage_be_strips7.tif", truth, **strips)
    tifffile.imwrite(folder / "plain_miniswhite.tif", truth, metadata=None, photometric="miniswhite")
    with tifffile.TiffWriter(folder / "odd_page_sizes.tif") as writer:
        for page in (truth[0], truth[1, :20, :20], truth[2]):
            writer.write(page, metadata=None, photometric="minisblack", contiguous=False)


def write_broken(folder):
    def changed(source, name, at, patch):
        data = bytearray((folder / source).read_bytes())
        data[at : at + len(patch)] = patch
        (folder / name).write_bytes(data)

    lzw = (folder / "ome_u16_lzw.ome.tif").read_bytes()
    (folder / "bad_empty.tif").write_bytes(b"")
    (folder / "bad_truncated_8bytes.tif").write_bytes(lzw[:8])
    (folder / "bad_truncated_half.tif").write_bytes(lzw[: len(lzw) // 2])
    changed("ome_u16_lzw.ome.tif", "bad_lzw_corrupt_data.tif", len(lzw) // 3, b"\xff" * 64)
    strips = "plain_multipage_be_strips7.tif"
    with tifffile.TiffFile(folder / strips) as tiff:
        width, last = tiff.pages[0].tags["ImageWidth"], tiff.pages[-1]
        link = last.offset + 2 + 12 * len(last.tags)
    changed(strips, "bad_huge_width.tif", width.offset + 2, struct.pack(">HII", 4, 1, 2**31 - 1))
    changed(strips, "bad_ifd_loop.tif", link, (8).to_bytes(4, "big"))


def write_whale(source, folder):
    """A tenth of the scan's triangles, still watertight; and the vertices of that as text."""
    scan = trimesh.load(source, process=False)
    vertices, triangles = igl.decimate(np.asarray(scan.vertices, float), np.asarray(scan.faces, np.int64), 10_000)[:2]
    vertices = vertices.astype(np.float32)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent
    (folder / "meshes/pilot-whale-cranium-10k.ply").write_bytes(mesh.export(file_type="ply", vertex_normal=False))
    rows = (" ".join(f"{x:.9g}" for x in row) for row in vertices.tolist())
    (folder / "points/pilot-whale-cranium-5k.xyz").write_text("\n".join(rows) + "\n")


def main():
    mouse, whale, folder = (Path(argument) for argument in sys.argv[1:])
    derived = folder / "tiff-derived"
    for name in (derived, folder / "meshes", folder / "points"):
        name.mkdir(parents=True, exist_ok=True)
    truth = np.ascontiguousarray(tifffile.imread(mouse)[CROP])
    np.save(derived / "truth.npy", truth)
    for write in (write_imagej, write_packed, write_types, write_axes, write_plain):
        write(derived, truth)
    write_broken(derived)
    write_whale(whale, folder)


if __name__ == "__main__":
    main()
