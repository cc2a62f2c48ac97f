#!/usr/bin/env python3
"""Packs the demo stack: the same values, compressed without loss, with its spacing in the metadata.

    python scripts/pack_demo.py SOURCE.tif data/arabidopsis-embryo.tif

SOURCE is `sampleImages/arabidopsis-embryo.tif` as published (see data/README.md). The result is an ImageJ hyperstack
(deflate, predictor 2) with 0.35 micron spacing on every axis; ImageJ, Fiji and tifffile read it. The values are
read back and compared before the script reports success.
"""

import argparse
import sys

import numpy as np
import tifffile

SPACING = 0.35  # micron


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source")
    parser.add_argument("out")
    arguments = parser.parse_args()

    with tifffile.TiffFile(arguments.source) as tif:
        stack = tif.asarray()
        info = (tif.imagej_metadata or {}).get("Info", "")
    tifffile.imwrite(
        arguments.out,
        stack,
        imagej=True,
        resolution=(1.0 / SPACING, 1.0 / SPACING),
        compression="zlib",
        compressionargs={"level": 9},
        predictor=True,
        rowsperstrip=stack.shape[1],
        metadata={"axes": "ZYX", "spacing": SPACING, "unit": "micron", "Info": info},
    )
    if not np.array_equal(tifffile.imread(arguments.out), stack):
        sys.exit(f"{arguments.out}: the values differ from {arguments.source}")
    print(f"{arguments.out}: {stack.shape} {stack.dtype}, values equal to the source")


if __name__ == "__main__":
    main()
