"""The rounds: every entry once with one thread and once with two, then all again, so that a disturbance meets all."""

from statistics import median

from .entries import Failed

PATIENCE = 20.0  # seconds: an entry that has taken so long in all is not run again


class Tally:
    """What is known of one entry: its samples by number of threads, what failed, the errors of its field."""

    def __init__(self, entry):
        self.entry = entry
        self.samples = {threads: [] for threads in entry.threads()}
        self.failed = {}
        self.errors = None

    def wants(self, threads):
        """True when one more run is due."""
        if threads not in self.samples or threads in self.failed:
            return False
        return sum(sample.seconds for sample in self.samples[threads]) <= PATIENCE

    def run(self, case, threads, scratch):
        entry = self.entry
        name = f"{case.name}, {threads} thread(s): {entry.program} {entry.method}"
        try:
            if self.errors is None:
                sample, self.errors = entry.first(case, threads, scratch)
            else:
                sample = entry.run(case, threads)
        except (Failed, OSError, ValueError) as error:
            self.failed[threads] = str(error)
            print(f"  {name}: {error}", flush=True)
            return
        self.samples[threads].append(sample)
        print(f"  {name}: {sample.seconds:.3f} s", flush=True)

    def row(self, case):
        """A dict of plain values, ready for JSON."""
        entry = self.entry
        reasons = [f"with {threads} threads: {reason}" for threads, reason in self.failed.items()]
        about = {"program": entry.program, "method": entry.method, "ours": entry.ours}
        used = [sample for samples in self.samples.values() for sample in samples]
        if not used:
            return {**about, "failed": next(iter(self.failed.values()))}
        times = {str(threads): [s.seconds for s in samples] for threads, samples in self.samples.items() if samples}
        mse, largest = self.errors
        return {
            **about,
            "note": "; ".join([*([entry.note] if entry.note else []), *reasons]),
            "version": entry.version,
            "seconds": {threads: median(taken) for threads, taken in times.items()},
            "runs": {threads: len(taken) for threads, taken in times.items()},
            "bytes_per_voxel": max(sample.bytes for sample in used) / case.grid.voxels,
            "mse": mse,
            "max_error": largest,
        }


def measure(case, entries, repeats, scratch):
    """One row per entry."""
    tallies = [Tally(entry) for entry in entries]
    for _ in range(repeats):
        for threads in (1, 2):
            for tally in tallies:
                if tally.wants(threads):
                    tally.run(case, threads, scratch)
    return [tally.row(case) for tally in tallies]
