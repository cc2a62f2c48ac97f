"""Results as Markdown and as a plot."""

from common import page

HEADER = [
    "program",
    "method",
    "1 thread, s",
    "2 threads, s",
    "speed-up",
    "ns/voxel",
    "B/voxel",
    "MSE",
    "max error / h",
    "runs",
]
EXPLAINED = """Seconds are medians; *runs* says of how many, with one and with two threads (an entry that took more
than 20 s in all is not run again). Each run is a process of its own, held on one processor or two; every program has
its turn before any has its second. Before each call as much memory as most of them take is touched and freed, so that
none waits for the host of a virtual machine to hand it out. Ours is everything from the sources in memory to the finished field,
initialisation included: the stages `sort sources` and `distance` of the report; where that field is the nearest
source, the remarks say how long reading the distances takes (the stage `read out`). The others' is the call, after
imports and a first call on a small input, with the input in memory in the form that the program wants; of calls
shorter than a second or so the best of three in the process (ours has one). B/voxel is the largest resident set
during the call less that before the input was read: input and result count. ns/voxel is that of the faster column.
Fields of ours and of edt, bioimage-cpp (fast marching: f64) and ITK are f32, those of scipy, scikit-fmm and pyfmm-kit
f64. Ours without a word about the schedule are those of the default, `front`."""


def tables(sections):
    """All cases: the sections in the order of their names' sizes."""
    parts = [EXPLAINED]
    for section in ordered(sections):
        parts.append(
            f"## {section['title']}\n\n{section['when']}\n\n"
            + page.table(HEADER, [line(r, section) for r in by_time(section["rows"])])
        )
        parts[-1] += "".join(f"\n\n{text}" for text in remarks(section))
    return "\n\n".join(parts)


def ordered(sections):
    return [
        sections[name]
        for name in sorted(sections, key=lambda name: (not name.startswith("cube"), sections[name]["voxels"], name))
    ]


def best(row):
    return min(row["seconds"].values()) if "seconds" in row else float("inf")


def by_time(rows):
    return sorted(rows, key=best)


def line(row, section):
    name = f"**{row['program']}**" if row["ours"] else row["program"]
    if "failed" in row:
        return [name, row["method"], row["failed"], *[None] * 7]
    one, two = row["seconds"].get("1"), row["seconds"].get("2")
    gain = f"{one / two:.2f}" if one and two else None
    mse = "-" if row["mse"] is None else f"{row['mse']:.1e}"
    largest = "-" if row["max_error"] is None else f"{row['max_error'] / section['spacing']:.2g}"
    runs = " + ".join(str(n) for n in row["runs"].values())
    speed = f"{best(row) / section['voxels'] * 1e9:.2f}"
    return [name, row["method"], time(one), time(two), gain, speed, f"{row['bytes_per_voxel']:.1f}", mse, largest, runs]


def time(seconds):
    return "-" if seconds is None else f"{seconds:.3g}"


def remarks(section):
    """Versions, and what a row's name does not say."""
    rows = [row for row in section["rows"] if "failed" not in row]
    versions = sorted({f"{row['program']} {row['version']}".strip() for row in rows})
    notes = [f"{row['program']} {row['method']}: {row['note']}" for row in rows if row["note"]]
    return [
        f"Versions: {', '.join(versions)}.",
        *([f"{'; '.join(notes)}."] if notes else []),
        *section.get("remarks", []),
    ]


def plot(sections, path):
    """Nanoseconds per voxel of every case on a grid, ours in another colour."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "strandline"
    from matplotlib import pyplot

    cubes = [section for section in ordered(sections) if section["name"].startswith("cube")]
    if not cubes:
        return False
    figure, axes = pyplot.subplots(1, len(cubes), figsize=(5.2 * len(cubes), 5.2), squeeze=False, layout="constrained")
    for axis, section in zip(axes[0], cubes):
        rows = by_time([row for row in section["rows"] if "failed" not in row])[::-1]
        names = [f"{row['program']}, {row['method']}" for row in rows]
        values = [best(row) / section["voxels"] * 1e9 for row in rows]
        bars = axis.barh(names, values, color=["#0072b2" if row["ours"] else "#b0b0b0" for row in rows])
        axis.bar_label(bars, [f"{value:.3g}" for value in values], padding=2, fontsize=7)
        axis.set_xscale("log")
        axis.set_xlim(1, 4 * max(values))
        axis.set_xlabel("ns per voxel")
        axis.set_title(section["title"])
        axis.tick_params(axis="y", labelsize=7)
    figure.savefig(path, metadata={"Date": None})
    return True
