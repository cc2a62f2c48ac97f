"""The rounds: every entry once with one thread and once with two, then all again, so that a disturbance meets all."""

from collections import defaultdict
from statistics import median

from .entries import Failed

PATIENCE = 20.0  # seconds: an entry that has taken so long in all is not run again


def measure(case, entries, repeats, scratch):
    """One row per entry: a dict of plain values, ready for JSON."""
    samples, failed, errors = defaultdict(list), {}, {}
    for _ in range(repeats):
        for threads in (1, 2):
            for place, entry in enumerate(entries):
                spent = sum(sample.seconds for sample in samples[place, threads])
                if threads not in entry.threads() or place in failed or spent > PATIENCE:
                    continue
                try:
                    if place in errors:
                        sample = entry.run(case, threads)
                    else:
                        sample, errors[place] = entry.first(case, threads, scratch)
                except Failed as error:
                    failed[place] = str(error)
                    print(f"  {entry.program} {entry.method}: {error}", flush=True)
                    continue
                samples[place, threads].append(sample)
                print(
                    f"  {case.name}, {threads} thread(s): {entry.program} {entry.method}: {sample.seconds:.3f} s",
                    flush=True,
                )
    return [row(case, entry, place, samples, failed, errors) for place, entry in enumerate(entries)]


def row(case, entry, place, samples, failed, errors):
    about = {"program": entry.program, "method": entry.method, "note": entry.note, "ours": entry.ours}
    if place in failed:
        return {**about, "failed": failed[place]}
    times = {threads: [sample.seconds for sample in samples[place, threads]] for threads in (1, 2)}
    used = [sample for threads in (1, 2) for sample in samples[place, threads]]
    mse, largest = errors[place]
    return {
        **about,
        "version": entry.version,
        "seconds": {str(threads): median(taken) for threads, taken in times.items() if taken},
        "runs": {str(threads): len(taken) for threads, taken in times.items() if taken},
        "bytes_per_voxel": max(sample.bytes for sample in used) / case.grid.voxels,
        "mse": mse,
        "max_error": largest,
    }
