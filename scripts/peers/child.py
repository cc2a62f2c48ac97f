"""Runs one peer, in a process of its own: `python -m peers.child TABLE NUMBER CASE.npz THREADS OUT.npy`.

Prints one line of JSON: seconds and bytes of the call, version. Reading the input, imports and a first call on a small
input are not in the time; of a short call the best of three counts. Bytes are the peak during the calls less what the
process held after its imports, so the input counts. OUT.npy `-`: the field is not kept.
"""

import importlib.metadata
import json
import os
import resource
import sys
import time

import numpy as np

from . import adapters
from .warm import warm

CALLS, SHORT = 3, 2.0  # so many calls as long as they took less than so many seconds in all


def status(field):
    """A line of /proc/self/status, bytes."""
    with open("/proc/self/status") as file:
        line = next(line for line in file if line.startswith(field + ":"))
    return int(line.split()[1]) * 1024


def forget_peak():
    """The kernel counts the peak from here on."""
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def spare_the_machine():
    """A peer that asks for more memory than is free gets an error, before the kernel ends some other process."""
    with open("/proc/meminfo") as file:
        free = next(int(line.split()[1]) * 1024 for line in file if line.startswith("MemAvailable"))
    limit = status("VmSize") + free * 9 // 10
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def small_case(is_mesh):
    if is_mesh:
        corners = np.array([[1, 1, 1], [6, 1, 1], [1, 6, 1], [1, 1, 6]], dtype=float)
        faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        return {"vertices": corners, "faces": faces, "shape": np.array([9] * 3), "spacing": 1.0, "origin": np.zeros(3)}
    mask = np.zeros((16, 16, 16), dtype=bool)
    mask[8, 8, 8] = True
    return {"mask": mask, "spacing": 1.0}


def version(package):
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        # Debian's OpenVDB is no Python package; its module knows.
        module = sys.modules.get("pyopenvdb")
        return ".".join(map(str, module.LIBRARY_VERSION)) if module else ""


def measure(peer, path, threads, out, is_mesh):
    peer.prepare(small_case(is_mesh), threads)()
    baseline = status("VmRSS")
    spare_the_machine()
    with np.load(path) as stored:
        case = {name: stored[name] for name in stored.files}
    if "mask" in case:
        case["spacing"] = float(case["spacing"])
    run = peer.prepare(case, threads)
    voxels = case["mask"].size if "mask" in case else int(case["shape"].prod())
    seconds = []
    while not seconds or (len(seconds) < CALLS and sum(seconds) < SHORT):
        field = None  # its memory is free again before the next call
        warm(voxels)
        if not seconds:
            forget_peak()
        started = time.perf_counter()
        field = run()
        seconds.append(time.perf_counter() - started)
    peak = status("VmHWM")
    if out != "-":
        np.save(out, field)
    package = "itk-core" if peer.program == "itk" else peer.program
    return {"seconds": min(seconds), "bytes": peak - baseline, "version": version(package)}


def main():
    table, number, path, threads, out = sys.argv[1:]
    peer = getattr(adapters, table)[int(number)]
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ[name] = threads
    try:
        found = measure(peer, path, int(threads), out, table == "MESH_PEERS")
    except Exception as error:  # noqa: BLE001  whatever a peer raises becomes its row
        found = {"failed": f"{type(error).__name__}: {error}".splitlines()[0]}
    print("\n" + json.dumps(found))


if __name__ == "__main__":
    main()
