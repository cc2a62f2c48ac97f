"""scripts/fuzz_readers: every reader on damaged files: no panic, no hang, no more memory than allowed.

Each reader runs in a process of its own whose address space is limited, on files that are whole and then damaged (tests/all/fuzz). Inputs at
which it panics, is refused in other than one sentence, runs out of memory or hangs are put into tests/kept, one folder each; the tests read
them from then on. Exit code 1 when there were any.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
READERS = ("points", "meshes", "rois", "tiff", "slices", "zarr")
# Seconds after the end of its time in which a process has to end.
GRACE = 30


def arguments():
    parser = argparse.ArgumentParser(
        prog="scripts/fuzz_readers", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=60, metavar="N", help="time for each reader (60)")
    parser.add_argument("--format", action="append", choices=READERS, help="only this reader; may be repeated (all)")
    parser.add_argument("--seeds", type=Path, metavar="DIR", help="also damage small files found there, by their endings")
    parser.add_argument("--seed", type=int, default=None, metavar="N", help="of the random numbers (the time)")
    parser.add_argument("--hang", type=float, default=10, metavar="S", help="an input that takes longer hangs (10)")
    parser.add_argument("--memory", type=float, default=1, metavar="GIB", help="address space of a process (1)")
    parser.add_argument("--kept", type=Path, default=ROOT / "tests" / "kept", help="where inputs are kept (tests/kept)")
    parser.add_argument("--slow", type=Path, default=ROOT / "target" / "fuzz-slow", help="where slow ones are put, for a look (target/fuzz-slow)")
    parser.add_argument("--binary", type=Path, help="a built tests/all, in place of building it")
    return parser.parse_args()


def built():
    """The test program, built with the checks of a debug build."""
    command = ["cargo", "test", "--no-run", "--test", "all", "--message-format=json", "--manifest-path", ROOT / "Cargo.toml"]
    done = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, text=True, check=True)
    messages = map(json.loads, done.stdout.splitlines())
    return next(m["executable"] for m in messages if m.get("executable") and m["target"]["name"] == "all")


@dataclass
class Outcome:
    """What came of one reader."""

    inputs: int = 0
    slowest: float = 0.0
    faults: list = field(default_factory=list)
    slow: list = field(default_factory=list)


def keep(folder, reader, kept):
    """Copies an input to where the tests find it; the name says what it holds."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    digest = hashlib.sha256()
    for path in files:
        digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    place = kept / f"{reader}-{digest.hexdigest()[:12]}"
    if not place.exists():
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(folder, place)
    return place


def last_change(folder):
    """When a file of the input that is being read was written last; now, while the input is being exchanged."""
    try:
        return max(path.stat().st_mtime for path in folder.rglob("*"))
    except (OSError, ValueError):
        return time.time()


def start(binary, reader, seconds, seed, folder, settings):
    """One process, until it ends or its time is up."""
    limit = int(settings.memory * 2**30)
    told = {"READER": reader, "SECONDS": max(1, round(seconds)), "SEED": seed, "FOLDER": folder}
    if settings.seeds:
        told["SEEDS"] = settings.seeds.resolve()
    environment = os.environ | {f"STRANDLINE_FUZZ_{name}": str(value) for name, value in told.items()}
    command = [str(binary), "--exact", "fuzz::worker", "--ignored", "--nocapture", "--test-threads=1"]
    log = (folder / "log").open("w")
    return subprocess.Popen(
        command,
        env=environment,
        stdout=log,
        stderr=subprocess.STDOUT,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )


def wait(child, folder, seconds, hang):
    """Waits for a process; says whether it had to be ended."""
    until = time.time() + seconds + GRACE
    try:
        while child.poll() is None:
            time.sleep(0.2)
            now = time.time()
            if now > until or now - last_change(folder / "input") > hang:
                return True
        return False
    finally:
        child.kill()
        child.wait()


def told(line):
    """Word and rest of what a process tells; its first line follows the test's name without a line break."""
    found = re.search(r"(?:^|\.\.\. )(fault|slow|slowest) (.+)", line)
    return found.groups() if found else (None, "")


def fuzz(binary, reader, settings, seed):
    outcome = Outcome()
    end = time.time() + settings.seconds
    while time.time() < end - 0.5:
        scratch = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        with tempfile.TemporaryDirectory(dir=scratch) as name:
            folder = Path(name)
            left = end - time.time()
            child = start(binary, reader, left, seed, folder, settings)
            hung = wait(child, folder, left, settings.hang)
            count = folder / "count"
            outcome.inputs += int(count.read_text() or 0) if count.exists() else 0
            log = (folder / "log").read_text(errors="replace").splitlines()
            for word, rest in map(told, log):
                if word == "fault":
                    place, what = rest.split(" ", 1)
                    outcome.faults.append((keep(Path(place), reader, settings.kept), what))
                if word == "slow":
                    place, took = rest.split(" ", 1)
                    outcome.slow.append((keep(Path(place), reader, settings.slow), took))
                if word == "slowest":
                    outcome.slowest = max(outcome.slowest, float(rest))
            if hung or child.returncode != 0:
                what = f"took more than {settings.hang:g} s" if hung else f"ended with {child.returncode}: {' '.join(log[-3:])[:300]}"
                if not (folder / "input").exists():
                    sys.exit(f"{reader}: the test program {what}")
                outcome.faults.append((keep(folder / "input", reader, settings.kept), what))
        seed += 1
    return outcome


def main():
    settings = arguments()
    binary = settings.binary or built()
    seed = settings.seed if settings.seed is not None else int(time.time())
    total, bad = 0, 0
    for reader in settings.format or READERS:
        outcome = fuzz(binary, reader, settings, seed)
        total += outcome.inputs
        bad += len(outcome.faults)
        print(f"{reader}: {outcome.inputs:,} inputs, slowest {outcome.slowest:.3f} s, {len(outcome.faults)} faults", flush=True)
        for place, what in outcome.faults + outcome.slow:
            print(f"  {place}: {what}", flush=True)
    print(f"{total:,} inputs from seed {seed} on, {bad} faults")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
