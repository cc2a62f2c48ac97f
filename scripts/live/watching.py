"""What somebody sees who reads a store while it is written: boxes of its arrays, held against the finished store."""

import json
import random
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import zarr

# Voxels along the edge of a box that is read at random.
EDGE = 64


@dataclass
class Seen:
    """A box of an array, as it was at a moment."""

    array: str
    box: tuple
    values: np.ndarray


@dataclass
class Watcher:
    """Reads a store again and again."""

    store: Path
    numbers: random.Random
    seen: list = field(default_factory=list)
    errors: list = field(default_factory=list)
    looks: int = 0
    # The share of the run that the store said was done, at each look.
    told: list = field(default_factory=list)
    # When the coarsest level of the image at the root held something.
    first_picture: float | None = None
    shown: dict = field(default_factory=dict)

    def look(self, seconds):
        """Reads the coarsest level of each image, and boxes of the finer ones."""
        try:
            attributes = json.loads((self.store / "zarr.json").read_text())["attributes"]
            group = zarr.open_group(self.store, mode="r")
        except FileNotFoundError:
            return
        self.looks += 1
        self.told.append(attributes["strandline"]["done"])
        try:
            for path in images(self.store):
                self.read(group, path, seconds)
        except Exception as error:  # noqa: BLE001 - whatever a reader stumbles over is what is looked for
            self.errors.append(f"{type(error).__name__}: {error}")

    def read(self, group, path, seconds):
        levels = group[path].attrs["ome"]["multiscales"][0]["datasets"] if path else group.attrs["ome"]["multiscales"][0]["datasets"]
        names = [f"{path}/{level['path']}".lstrip("/") for level in levels]
        for number, name in enumerate(names):
            array = group[name]
            small = array.size <= 256**3
            box = tuple(slice(0, n) for n in array.shape) if small else self.random_box(array.shape)
            values = array[box]
            if number == len(names) - 1:
                self.shown[path] = float(np.mean(values != array.fill_value))
                if path == "" and self.first_picture is None and self.shown[path] > 0:
                    self.first_picture = seconds
            if np.any(values != array.fill_value):
                self.seen.append(Seen(name, box, values))

    def random_box(self, shape):
        corner = [self.numbers.randrange(0, max(1, n - EDGE)) for n in shape]
        return tuple(slice(lo, lo + EDGE) for lo in corner)

    def faults(self):
        """What was not as it should be, now that the store is finished."""
        faults = list(self.errors)
        group = zarr.open_group(self.store, mode="r")
        state = group.attrs["strandline"]["state"]
        if state != "complete":
            faults.append(f"the finished store says {state!r}")
        if self.told != sorted(self.told):
            faults.append("the share that is done has fallen")
        for seen in self.seen:
            array = group[seen.array]
            shown = seen.values != array.fill_value
            if not np.array_equal(seen.values[shown], array[seen.box][shown]):
                faults.append(f"{seen.array} {seen.box} was shown with other values")
        return faults


def images(store):
    """Paths of the groups of a store that are images."""
    found = []
    for document in sorted(store.rglob("zarr.json")):
        attributes = json.loads(document.read_text()).get("attributes", {})
        if "multiscales" in attributes.get("ome", {}):
            found.append(str(document.parent.relative_to(store)).removeprefix("."))
    return found
