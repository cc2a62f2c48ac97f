"""How the program is run for these tables, and what its runs are called in them."""

import hashlib
import json
import os
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from common.program import METHODS, Program, Run, RunFailed

# The papers' setting, and what a user gets without any flag.
SWEEP = ("--schedule", "sweep", "--precision", "f64", "--threads", "1")
DEFAULT = ()


@dataclass
class Setting:
    """One run of the script."""

    program: Program
    methods: list
    finest: int
    scratch: Path
    data: Path | None
    kept: Path | None = None
    # Runs that would take longer than so many seconds are left out.
    patience: float = float("inf")
    speeds: dict = field(default_factory=dict)
    # The largest load of the machine, by which seconds are to be judged.
    load: float = 0.0

    def grids(self, grids):
        """Those no finer than asked for, as (index, grid)."""
        return [(n, grid) for n, grid in enumerate(grids) if max(grid.shape) <= self.finest]

    def run(self, method, sources, grid, flags, store=None, measure=None):
        """A run, or the sentence that says why there is none; and what `measure` says of its store, where it is given.

        With --keep a run that was done before is not done again.
        """
        if method not in self.methods:
            return "not in this version" if measure is None else ("not in this version", None)
        flags = ["--method", method, *flags]
        print(f"  {grid}: {' '.join(flags)}", flush=True)
        place = self.place_of(sources, [*grid.flags(), *flags])
        if place and place.exists():
            report, measured, load = json.loads(place.read_text())
            self.learn(method, flags, Run(report), load)
            return Run(report) if measure is None else (Run(report), measured)
        expected = grid.voxels * self.speeds.get((method, *flags), 0.0)
        if expected > self.patience:
            why = f"the run on {grid} points was left out: about {expected / 60:.0f} minutes, by the grid before it"
            return why if measure is None else (why, None)
        try:
            run = self.program.distance(sources, [*grid.flags(), *flags], store=store)
        except RunFailed as error:
            print(f"    {error}", flush=True)
            return str(error) if measure is None else (str(error), None)
        load = os.getloadavg()[0]
        self.learn(method, flags, run, load)
        measured = measure and measure()
        if place:
            place.write_text(json.dumps([run.report, measured, load]))
        return run if measure is None else (run, measured)

    def learn(self, method, flags, run, load):
        """Seconds a voxel, for what the next grid will take; and how busy the machine was."""
        self.speeds[(method, *flags)] = run.seconds / run.voxels
        self.load = max(self.load, load)

    def busy(self):
        """A sentence where other programs took the processors."""
        cores = os.cpu_count() or 1
        if self.load <= 2 * cores:
            return ""
        return f" Other programs kept the machine busy (load up to {self.load:.0f} on {cores} cores): seconds are too large."

    def place_of(self, sources, flags):
        """Where the result of a run is kept: a name made of the program, the sources' bytes, and the flags."""
        if self.kept is None:
            return None
        name = hashlib.sha256(Path(self.program.path).read_bytes())
        for source in sources:
            name.update(Path(source).read_bytes())
        name.update("\0".join(flags).encode())
        self.kept.mkdir(parents=True, exist_ok=True)
        return self.kept / f"{name.hexdigest()[:24]}.json"


def run(setting, command, flags, *, store=None):
    """A run of another command than `distance`: its report, or the sentence that says why there is none."""
    print(f"  {' '.join(map(str, [*command, *flags]))}", flush=True)
    files = [word for word in command[1:] if Path(word).is_file()]
    words = list(map(str, [command[0], *flags]))
    # One that leaves something behind is done again.
    place = None if store or "--mesh" in words else setting.place_of(files, words)
    if place and place.exists():
        return json.loads(place.read_text())
    path = setting.scratch / "report.json"
    output = ["-o", str(store or "none"), "--report", str(path), "--overwrite", "-q"]
    done = subprocess.run(
        [setting.program.path, *map(str, command), *output, *words[1:]], capture_output=True, text=True
    )
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or ["failed"])[-1]
    setting.load = max(setting.load, os.getloadavg()[0])
    report = json.loads(path.read_text())
    if place:
        place.write_text(json.dumps(report))
    return report


class Notes:
    """Sentences below a table; the same one only once."""

    def __init__(self):
        self.lines = []

    def add(self, text):
        if text not in self.lines:
            self.lines.append(text)

    def markdown(self):
        return "".join(f"- {line}\n" for line in self.lines)


def seconds(run, notes, method):
    """A table's cell: the time of a run, or a dash whose reason goes to the notes."""
    if isinstance(run, str):
        notes.add(f"{method.upper()}: {run}.")
        return "-"
    return f"{run.seconds:.3f}" if run.seconds < 100 else f"{run.seconds:.1f}"


def rows_of_times(runs, index, grid, printed, notes):
    """The paper's line and ours below it; `runs[method]` is (sweep, default)."""
    fixed = [] if printed.fixed is None else [printed.fixed]
    yield [grid, f"{grid.spacing:.7g}", "paper", *fixed, printed.initial, *(getattr(printed, m) for m in METHODS)]
    for which, name in enumerate(("sweep", "default")):
        line = [runs[method][index][which] for method in METHODS]
        ours = [next((run.result["fixed_voxels"] for run in line if not isinstance(run, str)), "-")] if fixed else []
        yield [None, None, name, *ours, None, *(seconds(run, notes, m) for run, m in zip(line, METHODS))]


TIMES_EXPLAINED = (
    "`sweep`: the papers' one iteration of eight ordered sweeps (FMM, DP: one queue over the whole grid) in f64 on\n"
    "one thread. `default`: no flag but `--method`, that is the `front` schedule in f32 on all cores. Seconds; ours\n"
    "hold the initial condition, which is made together with the first sweep. The paper's are of another machine."
)
