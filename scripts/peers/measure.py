"""The rounds: every entry once with one thread and once with two, then all again, so that a disturbance meets all."""

from collections import defaultdict
from statistics import median

from .entries import Failed

PATIENCE = 20.0  # seconds: an entry that has taken so long in all is not run again


def measure(case, entries, repeats, scratch):
    """One row per entry: a dict of plain values, ready for JSON."""
    samples, failed, errors = defaultdict(list), {}, {}
    for number in range(repeats):
        for threads in (1, 2):
            for place, entry in enumerate(entries):
                spent = sum(sample.seconds for sample in samples[place, threads])
                if threads not in entry.threads() or place in failed or spent > PATIENCE:
                    continue
                try:
                    samples[place, threads].append(entry.run(case, threads))
                    tell(case, entry, threads, samples[place, threads][-1].seconds)
                except Failed as error:
                    failed[place] = str(error)
                    print(f"  {entry.program} {entry.method}: {error}", flush=True)
    for place, entry in enumerate(entries):
        if place not in failed:
            try:
                errors[place] = entry.errors(case, scratch)[0]
            except Failed as error:
                failed[place] = str(error)
    return [row(case, entry, place, samples, failed, errors) for place, entry in enumerate(entries)]


def tell(case, entry, threads, seconds):
    print(f"  {case.name}, {threads} thread(s): {entry.program} {entry.method}: {seconds:.3f} s", flush=True)


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
