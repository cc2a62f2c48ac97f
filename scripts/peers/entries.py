"""What is measured on a case: peers and our own methods behind one interface, one call a process each."""

import json
import os
import shutil
import subprocess
from dataclasses import dataclass

import numpy as np
import zarr

from common.program import RunFailed

from . import adapters
from .warm import warm

HEAPS = ("fmm", "dp")  # what `--schedule sweep` does by one heap
MOST_ON_A_HEAP = 300  # points along an edge
TRACKING = ("vdt", "dp")  # whose field is the nearest source
LAYER = 64  # planes compared at a time
NAMES = {
    "fsm": "fast sweeping",
    "vdt": "vector distance transform",
    "fmm": "fast marching",
    "dp": "Dijkstra-Pythagoras",
}


@dataclass
class Sample:
    """One timed call."""

    seconds: float
    bytes: int


class Failed(Exception):
    """A program that did not install or run; holds the reason."""


def processors(threads):
    """The last ones of those that may be used: the first serves the most interrupts."""
    return set(sorted(os.sched_getaffinity(0))[-threads:])


@dataclass
class PeerEntry:
    """A peer, called in a child process of its group's Python."""

    number: int
    table: str
    peer: adapters.Peer
    python: str
    absent: str | None
    ours = False

    @property
    def program(self):
        return self.peer.program

    @property
    def method(self):
        return self.peer.method

    @property
    def note(self):
        return self.peer.note

    def threads(self):
        return self.peer.threads

    def run(self, case, threads, keep=None):
        """A sample; the field goes to `keep`, a path, when there is one."""
        if self.absent:
            raise Failed(self.absent)
        command = [str(self.python), "-m", "peers.child", self.table, str(self.number), str(case.stored), str(threads)]
        pin = lambda: os.sched_setaffinity(0, processors(threads))  # noqa: E731
        done = subprocess.run([*command, str(keep or "-")], capture_output=True, text=True, preexec_fn=pin)
        if done.returncode != 0:
            raise Failed(f"ended with code {done.returncode}")
        found = json.loads(done.stdout.strip().splitlines()[-1])
        if "failed" in found:
            raise Failed(found["failed"])
        self.version = found["version"]
        return Sample(found["seconds"], found["bytes"])

    def first(self, case, threads, scratch):
        """A sample whose field is compared: mean squared and largest error beside it."""
        kept = scratch / "field.npy"
        sample = self.run(case, threads, keep=kept)
        field = np.load(kept, mmap_mode="r")
        found = case.errors(((z, field[z : z + LAYER]) for z in range(0, len(field), LAYER)), self.peer.band)
        kept.unlink()
        return sample, found


@dataclass
class OwnEntry:
    """One of our methods; `band`: only as far as so many voxels; `signed`: the sign's time counts too."""

    program_object: object
    key: str
    flags: tuple
    suffix: str = ""
    band: float | None = None
    signed: bool = False
    program = "strandline"
    ours = True

    def __post_init__(self):
        self.method = NAMES[self.key] + self.suffix
        self.note = ""
        self.version = self.program_object.version()
        self.baseline = None

    def threads(self):
        return (1, 2)

    def all_flags(self, case):
        far = [f"--max-distance={self.band * case.grid.spacing!r}"] if self.band else []
        return ["--method", self.key, *case.flags, *self.flags, *far]

    def run(self, case, threads, keep=None):
        settings = {"cpus": processors(threads), "store": keep}
        flags = [*self.all_flags(case), "--threads", str(threads)]
        warm(case.grid.voxels)
        try:
            run = self.program_object.distance([case.source], flags, **settings)
            self.remark_reading(run)
            seconds = run.seconds
            if self.signed:
                with_sign = self.program_object.distance([case.source], [*flags, "--signed"], **settings)
                seconds += max(0.0, with_sign.report["seconds"] - run.report["seconds"])
        except RunFailed as error:
            raise Failed(str(error)) from error
        return Sample(seconds, run.peak_bytes - self.at_rest(case))

    def remark_reading(self, run):
        if self.key in TRACKING:
            reading = run.stage("read out")["seconds"]
            self.note = f"keeps the nearest source; reading all distances out of it took {reading:.2g} s more"

    def at_rest(self, case):
        """What the process holds before any field: the peak when sources are read."""
        if self.baseline is None:
            tiny = ["--method", self.key, "--spacing", repr(case.grid.spacing * case.grid.shape[0] / 8)]
            self.baseline = self.program_object.distance([case.source], tiny).stage("sort sources")["peak_rss_bytes"]
        return self.baseline

    def first(self, case, threads, scratch):
        """A sample, and the errors from a run that writes the field; a signed row has none, its unsigned one has."""
        sample = self.run(case, threads)
        if self.signed:
            return sample, (None, None)
        store = scratch / "field.zarr"
        try:
            self.run(case, threads, keep=store)
            field = zarr.open_array(str(store), path="0", mode="r")
            layers = ((z, field[z : z + LAYER]) for z in range(0, field.shape[0], LAYER))
            return sample, case.errors(layers, self.band)
        finally:
            shutil.rmtree(store, ignore_errors=True)


def peers(table, pythons, failures):
    """Every row of a table of adapters."""
    found = []
    for number, peer in enumerate(getattr(adapters, table)):
        package = "itk-core" if peer.program == "itk" else peer.program
        python = pythons.get(package, pythons[peer.group])
        found.append(PeerEntry(number, table, peer, python, failures.get(package)))
    return found


def ours_on_grids(program, n):
    """All methods by default and as textbooks do them; one heap over a grid of more than MOST_ON_A_HEAP takes minutes."""
    methods = program.methods()
    textbook = [m for m in methods if m not in HEAPS or n <= MOST_ON_A_HEAP]
    sweeps = [OwnEntry(program, m, ("--schedule", "sweep"), ", `--schedule sweep`") for m in textbook]
    return [OwnEntry(program, m, ()) for m in methods] + sweeps


def ours_on_meshes(program):
    """Whole grids with all methods, and what OpenVDB does: a signed band, a signed grid."""
    whole = [OwnEntry(program, m, ()) for m in program.methods()]
    band = OwnEntry(program, "vdt", (), ", band of 3 voxels", band=3.0)
    signs = [
        OwnEntry(program, "vdt", (), ", band of 3 voxels, signed", band=3.0, signed=True),
        OwnEntry(program, "vdt", (), ", signed", signed=True),
    ]
    return [*whole, band, *signs]
