"""scripts/bench_peers: installs other programs, times them and this one, and writes docs/performance.md.

Results are kept in target/bench_peers.json by case; a run replaces the cases that it measured, and the page shows all.
"""

import argparse
import json
import os
import signal
import sys
import tempfile
from pathlib import Path

from common import page
from common.program import Program

from . import cases, entries, install, large, report
from .measure import measure

MESHES = {"teddy": "teddy-cgal-bear.off", "whale cranium": "pilot-whale-cranium.ply"}
TITLE = """# Performance

Distance fields: other programs and this one on the same inputs, in one run, on one machine. `scripts/bench_peers`
installs the others, measures, and writes this page; [reproduction.md](reproduction.md) has the times of the papers'
experiments.

    scripts/bench_peers                                    # the Cube experiment at 145^3, 289^3, 577^3
    scripts/bench_peers --sizes --data FOLDER              # the meshes alone; FOLDER holds their files
    scripts/bench_peers --sizes --large                    # 1024^3 in 1 GiB; --huge: 2048 x 2048 x 1024 in 2 GiB
"""


def arguments():
    parser = argparse.ArgumentParser(prog="scripts/bench_peers", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--sizes", type=int, nargs="*", default=[145, 289, 577], metavar="N", help="Cube experiments (145 289 577)"
    )
    data = os.environ.get("STRANDLINE_DATA")
    parser.add_argument(
        "--data", type=Path, default=data and Path(data), help="folder with the meshes ($STRANDLINE_DATA)"
    )
    parser.add_argument("--mesh-size", type=int, default=256, metavar="N", help="edge of the meshes' grid (256)")
    parser.add_argument("--large", action="store_true", help="also 1024^3 with --memory 1GiB; 20 GB of --scratch")
    parser.add_argument(
        "--huge", action="store_true", help="also 2048 x 2048 x 1024 with --memory 2GiB; 60 GB of --scratch"
    )
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="runs of each entry (3)")
    parser.add_argument("--scratch", type=Path, help="folder for temporary files (the system's)")
    parser.add_argument(
        "--out", type=Path, default=page.ROOT / "docs" / "performance.md", help="page to write (docs/performance.md)"
    )
    return parser.parse_args()


def section(case, rows, program, remarks=()):
    return {
        "name": case.name,
        "title": case.title,
        "voxels": case.grid.voxels,
        "spacing": case.grid.spacing,
        "when": page.circumstances(program.version()),
        "rows": rows,
        "remarks": list(remarks),
    }


def run_cubes(settings, program, pythons, failures, scratch):
    for n in settings.sizes:
        case = cases.cube(n, scratch)
        chosen = [*entries.ours_on_grids(program, n), *entries.peers(case.table, pythons, failures)]
        yield section(case, measure(case, chosen, settings.repeats, scratch), program)


def run_meshes(settings, program, pythons, failures, scratch):
    for name, file in MESHES.items():
        path = next((p for p in sorted(settings.data.rglob(file))), None) if settings.data else None
        if path is None:
            print(f"{name} skipped: no {file} in the folder given by --data or STRANDLINE_DATA", flush=True)
            continue
        case = cases.mesh(name, path, scratch, pythons["numpy2"], settings.mesh_size)
        chosen = [*entries.ours_on_meshes(program), *entries.peers(case.table, pythons, failures)]
        remark = (
            "Errors at 20,000 random voxels against libigl's exact distances; those of a band at the voxels in it. "
            "OpenVDB's fields are signed; of ours, those named so, whose time is the unsigned one's and what the "
            "whole run takes longer with `--signed`."
        )
        yield section(case, measure(case, chosen, settings.repeats, scratch), program, [remark])


def run_large(settings, program, scratch):
    for size in large.SHAPES:
        if getattr(settings, size):
            rows = large.measure(program, size, program.methods(), scratch)
            yield size, {"when": page.circumstances(program.version()), "rows": rows}


def write(settings, kept):
    if not settings.out.exists():
        settings.out.parent.mkdir(exist_ok=True)
        settings.out.write_text(TITLE + "\n", encoding="utf-8")
    text = report.tables(kept["cases"])
    picture = settings.out.with_suffix(".svg")
    if report.plot(kept["cases"], picture):
        text = f"![Nanoseconds per voxel of all programs]({picture.name})\n\n{text}"
    for size in large.SHAPES:
        if size in kept["large"]:
            rows = kept["large"][size]
            title = f"## Larger than memory: {rows['rows'][0]['grid']}"
            text += f"\n\n{title}\n\n{rows['when']}\n\n{large.EXPLAINED}\n\n{large.table(rows['rows'])}"
    page.write_part(settings.out, "scripts/bench_peers", text)
    print(settings.out)


def main():
    settings = arguments()
    # So that temporary fields go also when the run is ended from outside.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    program = Program()
    target = Path(os.environ["STRANDLINE_TARGET"])
    results = target / "bench_peers.json"
    kept = json.loads(results.read_text()) if results.exists() else {"cases": {}, "large": {}}

    def keep(where, name, value):
        kept[where][name] = value
        results.write_text(json.dumps(kept, indent=1))
        write(settings, kept)

    with tempfile.TemporaryDirectory(dir=settings.scratch) as folder:
        scratch = Path(folder)
        if settings.sizes or settings.data:
            pythons, failures = install.environments(target)
            for found in run_cubes(settings, program, pythons, failures, scratch):
                keep("cases", found["name"], found)
            for found in run_meshes(settings, program, pythons, failures, scratch):
                keep("cases", found["name"], found)
        for size, found in run_large(settings, program, scratch):
            keep("large", size, found)


if __name__ == "__main__":
    main()
