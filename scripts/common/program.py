"""Calls the built program `strandline distance` and reads its reports and stores."""

import json
import os
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

METHODS = ("fsm", "vdt", "fmm", "dp")


class RunFailed(Exception):
    """The program ended with an error; holds its sentence."""


@dataclass(frozen=True)
class Run:
    """One finished run, by its report.json."""

    report: dict

    def stage(self, name):
        return next(stage for stage in self.report["stages"] if stage["name"] == name)

    @property
    def seconds(self):
        """From the sources in memory to the finished field, initialisation included; no reading, measuring, writing."""
        return self.stage("sort sources")["seconds"] + self.stage("distance")["seconds"]

    @property
    def peak_bytes(self):
        """Largest resident set of the process up to the end of the field."""
        return self.stage("distance")["peak_rss_bytes"]

    @property
    def result(self):
        return self.report["result"]

    @property
    def voxels(self):
        nz, ny, nx = self.report["grid"]["shape_zyx"]
        return nz * ny * nx

    @property
    def loads_per_brick(self):
        """Brick loads of the solve (a brick that was not resident) per brick of the grid."""
        edge = self.report["settings"]["brick"]
        bricks = 1
        for extent in self.report["grid"]["shape_zyx"]:
            bricks *= -(-extent // edge)
        return self.stage("distance")["brick_loads"] / bricks


class Program:
    """The program at `path`."""

    def __init__(self, path=None):
        self.path = str(path or os.environ["STRANDLINE"])

    def version(self):
        return self._text("--version").split()[-1]

    def methods(self):
        """Those of METHODS that `help distance` lists, in the order of METHODS."""
        words = " ".join(self._text("help", "distance").split())
        listed = re.search(r"Distance method: (.*?)\[default", words).group(1)
        return [name for name in METHODS if re.search(rf"\b{name} \(", listed)]

    def distance(self, sources, flags, *, store=None, cpus=None):
        """Computes a distance field; `store` keeps it, `cpus` is the set of processors that may be used."""
        with tempfile.TemporaryDirectory() as folder:
            report = Path(folder) / "report.json"
            output = store or "none"
            command = [
                self.path,
                "distance",
                *map(str, sources),
                *flags,
                "-o",
                str(output),
                "--report",
                str(report),
                "-q",
            ]
            pin = (lambda: os.sched_setaffinity(0, cpus)) if cpus else None
            done = subprocess.run(command, capture_output=True, text=True, preexec_fn=pin)
            if done.returncode != 0:
                lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
                raise RunFailed(lines[-1].removeprefix("strandline: "))
            return Run(json.loads(report.read_text()))

    def _text(self, *arguments):
        return subprocess.run([self.path, *arguments], capture_output=True, text=True, check=True).stdout
