"""Inputs large enough to be interrupted, the commands that read them, and one run that a signal may end."""

import math
import os
import random
import signal
import struct
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

# A run ends so many seconds after a signal at most; one that is terminated may take a checkpoint before.
LATEST = 2.0
LATEST_SAVED = 10.0
# What it may leave then.
SAVED = "out.zarr.checkpoint"


def sphere(path, count, seed):
    """Points on the unit sphere."""
    numbers = random.Random(seed)
    with path.open("w", encoding="ascii") as file:
        for _ in range(count):
            place = [numbers.gauss(0, 1) for _ in range(3)]
            length = math.hypot(*place)
            file.write(" ".join(f"{x / length:.6f}" for x in place) + "\n")


def stack(path, width, planes):
    """A TIFF stack of uncompressed planes of noise, one page each."""
    plane = random.Random(7).randbytes(width * width)
    entries = [
        (256, 4, width),
        (257, 4, width),
        (258, 3, 8),
        (259, 3, 1),
        (262, 3, 1),
        (273, 4, 0),
        (277, 3, 1),
        (278, 4, width),
        (279, 4, width * width),
    ]
    directory = 2 + 12 * len(entries) + 4
    with path.open("wb") as file:
        file.write(struct.pack("<2sHI", b"II", 42, 8))
        for number in range(planes):
            start = 8 + number * (directory + width * width)
            following = 0 if number == planes - 1 else start + directory + width * width
            file.write(struct.pack("<H", len(entries)))
            for tag, kind, value in entries:
                file.write(struct.pack("<HHII", tag, kind, 1, start + directory if tag == 273 else value))
            file.write(struct.pack("<I", following) + plane)


def ball_marks(path, centre, radius):
    """Outlines of a ball on each tenth slice, for a stack whose spacing is 1."""
    with path.open("w", encoding="ascii") as file:
        file.write("object,contour,x,y,z\n")
        for z in range(-radius + 10, radius, 10):
            ring = math.sqrt(radius**2 - z**2)
            for step in range(40):
                angle = 2 * math.pi * step / 40
                x, y = centre[0] + ring * math.cos(angle), centre[1] + ring * math.sin(angle)
                file.write(f"1,{z},{x:.3f},{y:.3f},{centre[2] + z}\n")


def commands(root, inputs):
    """The runs by name, their inputs written to a folder."""
    sphere(inputs / "ball.xyz", 20_000, 1)
    stack(inputs / "large.tif", 1024, 512)
    ball_marks(inputs / "large.csv", (512, 512, 256), 200)
    data = root / "data"
    output = ["-o", "out.zarr", "--report", "report.json", "-q"]
    one = ["--image-spacing", "1,1,1"]
    grid = ["--origin=-2,-2,-2", "--spacing", "0.0078125", "--shape", "512,512,512", "--closest-point"]
    embryo = [f"{data}/arabidopsis-embryo.tif", "--points", f"{data}/arabidopsis-marks.csv"]
    large = [f"{inputs}/large.tif", "--points", f"{inputs}/large.csv", *one]
    return {
        "distance": ["distance", f"{inputs}/ball.xyz", *grid, *output],
        "segment": ["segment", *embryo, "--mesh", "mesh.ply", *output],
        "reconstruct": ["reconstruct", f"{inputs}/ball.xyz", "--mesh", "mesh.ply", *output],
        "read": ["segment", *large, "--mesh", "mesh.ply", "--picture", "picture.png", *output],
    }


@dataclass
class Ended:
    """A run that a signal was sent to, or that ended before it was."""

    name: str
    moment: float
    sent: str
    code: int
    after: float
    left: list = field(default_factory=list)
    said: str = ""

    @property
    def faults(self):
        """What a run that is asked to end may not do."""
        found = []
        if self.after > (LATEST_SAVED if self.sent == "SIGTERM" and SAVED in self.left else LATEST):
            found.append(f"took {self.after:.1f} s to end")
        number = int(signal.Signals[self.sent])
        # In its first moments the program does not listen yet, and the system ends it; a shell says 128 + number of both.
        if self.code not in (0, 128 + number, -number):
            found.append(f"ended with {self.code}")
        left = [name for name in self.left if self.sent != "SIGTERM" or name != SAVED]
        if self.code != 0 and left:
            found.append(f"left {', '.join(left)}")
        hidden = [name for name in self.left if Path(name).name.startswith(".") or name.startswith("scratch/")]
        if self.code == 0 and hidden:
            found.append(f"left {', '.join(hidden)}")
        return found


def start(program, arguments, folder, scratch):
    """A run in a folder that is there, with another one for temporary fields."""
    environment = {**os.environ, "TMPDIR": str(scratch)}
    return subprocess.Popen(
        [program, *arguments],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    )


def start_alone(program, arguments, folder):
    """A run in an empty folder, with a folder in it for temporary fields."""
    (folder / "scratch").mkdir(parents=True)
    return start(program, arguments, folder, folder / "scratch")


def left_in(folder):
    """What lies in the folder of a run: entries of it and of the one for temporary fields."""
    places = [*folder.iterdir(), *(folder / "scratch").iterdir()]
    return sorted(str(place.relative_to(folder)) for place in places if place.name != "scratch")


def whole(program, arguments, folder):
    """Seconds that the run takes when it is left alone."""
    started = time.monotonic()
    child = start_alone(program, arguments, folder)
    _, said = child.communicate()
    if child.returncode != 0:
        raise SystemExit(f"a run that nobody ended failed ({child.returncode}): {said.strip()}")
    return time.monotonic() - started


def ended(program, name, arguments, folder, moment, sent, twice):
    """The run, sent a signal a while after its start, or two in a hurry."""
    child = start_alone(program, arguments, folder)
    try:
        child.wait(timeout=moment)
    except subprocess.TimeoutExpired:
        pass
    asked = time.monotonic()
    child.send_signal(signal.Signals[sent])
    if twice:
        time.sleep(0.03)
        child.send_signal(signal.Signals[sent])
    _, said = child.communicate()
    after = time.monotonic() - asked
    return Ended(name, moment, sent, child.returncode, after, left_in(folder), said.strip())
