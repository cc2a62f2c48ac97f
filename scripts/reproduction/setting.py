"""How the program is run for these tables, and what its runs are called in them."""

from dataclasses import dataclass
from pathlib import Path

from common.program import METHODS, Program, RunFailed

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

    def grids(self, grids):
        """Those no finer than asked for, as (index, grid)."""
        return [(n, grid) for n, grid in enumerate(grids) if max(grid.shape) <= self.finest]

    def run(self, method, sources, grid, flags, store=None):
        """A run, or the sentence that says why there is none."""
        if method not in self.methods:
            return "not in this version"
        flags = ["--method", method, *flags]
        print(f"  {grid}: {' '.join(flags)}", flush=True)
        try:
            return self.program.distance(sources, [*grid.flags(), *flags], store=store)
        except RunFailed as error:
            print(f"    {error}", flush=True)
            return str(error)


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
