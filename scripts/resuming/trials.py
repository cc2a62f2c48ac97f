"""One trial: a run that is ended, maybe several times, and gone on with until it is done."""

import hashlib
import os
import shutil
import signal
import subprocess
import time

from interrupting import runs

# What tells times or the folder, and no result, and the checksums of that.
VARYING = {"report.json", "report.html", "checksums.txt"}
# What a run may say that cannot go on: its checkpoint is none, and it says so.
REFUSED = 2
# A run that is terminated takes a checkpoint within so many seconds.
LATEST = 10.0


def start(program, arguments, folder, scratch, every):
    """The run, which takes checkpoints so often."""
    return runs.start(program, [*arguments, "--checkpoint-every", every], folder, scratch)


def digests(folder):
    """What a store and the files beside it hold."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.name not in VARYING:
            found[str(path.relative_to(folder))] = hashlib.blake2b(path.read_bytes()).hexdigest()
    return found


def damage(folder, numbers):
    """Flips a bit in a file of the checkpoints, or cuts it short; tells what."""
    files = sorted(path for path in (folder / "out.zarr.checkpoint").glob("0*") if path.stat().st_size)
    if not files:
        return "nothing"
    path = numbers.choice(files)
    bytes_ = bytearray(path.read_bytes())
    at = numbers.randrange(len(bytes_))
    if numbers.random() < 0.5:
        bytes_[at] ^= 1 << numbers.randrange(8)
        path.write_bytes(bytes_)
        return f"a bit of byte {at} of {path.name}"
    path.write_bytes(bytes_[:at])
    return f"{path.name} cut at {at}"


class Trial:
    """A run in an empty folder, ended as `how` says."""

    def __init__(self, program, arguments, place, seconds, how, numbers):
        self.program, self.arguments, self.seconds, self.how, self.numbers = program, arguments, seconds, how, numbers
        self.folder, self.scratch = place / "run", place / "scratch"
        shutil.rmtree(self.folder, ignore_errors=True)
        shutil.rmtree(self.scratch, ignore_errors=True)
        self.folder.mkdir()
        self.scratch.mkdir()
        self.said, self.steps, self.faults = [], [], []

    def once(self, resume, moment, sent):
        """One run, sent a signal after a while if it is not done by then; its code."""
        every = f"{self.numbers.choice([20, 50, 100, 300])}ms"
        child = start(
            self.program, [*self.arguments, *(["--resume"] if resume else [])], self.folder, self.scratch, every
        )
        asked = None
        if sent is not None:
            try:
                child.wait(timeout=moment)
            except subprocess.TimeoutExpired:
                child.send_signal(sent)
                asked = time.monotonic()
        _, said = child.communicate()
        if asked and time.monotonic() - asked > LATEST:
            self.faults.append(f"took {time.monotonic() - asked:.1f} s to end")
        self.said.append(said.strip())
        self.steps.append(f"{moment:.2f} s: {child.returncode}" if sent else f"whole: {child.returncode}")
        return child.returncode

    def look_at_unfinished(self, wanted):
        """What stands under the store's name is all of it: a signal may come when all is written."""
        store = {name for name in wanted if name.startswith("out.zarr/")}
        found = digests(self.folder)
        if (self.folder / "out.zarr").exists() and any(found.get(name) != wanted[name] for name in store):
            self.faults.append("a store stands under its name that is not finished")

    def look_at_what_a_full_disk_is_told(self):
        """What is needed, and that there is a checkpoint where there is one."""
        last = self.said[-1].splitlines()[-1]
        if "No space left" in last and "of disk" not in last:
            self.faults.append("it is not told what a full disk needs")
        kept = any((self.folder / "out.zarr.checkpoint").glob("0*.checkpoint"))
        if "No space left" in last and kept != ("--resume goes on from the checkpoint in" in last):
            self.faults.append("a checkpoint is told that is not there, or not that there is one")

    def ended(self, wanted):
        """Ends the run once to three times; whether it was done before."""
        sent = signal.SIGTERM if self.how == "term" else signal.SIGKILL
        for turn in range(self.numbers.randint(1, 3)):
            code = self.once(turn > 0, self.numbers.uniform(0, self.seconds), sent)
            if code == 0:
                return True
            if code not in (-int(sent), 128 + int(sent)):
                self.faults.append(f"ended with {code}")
            self.look_at_unfinished(wanted)
        return False

    def run(self, wanted):
        """The whole trial; `wanted` is what a run gives that nobody ended."""
        done = self.ended(wanted)
        if self.how == "damage" and not done:
            self.steps.append(damage(self.folder, self.numbers))
        code = 0 if done else self.once(True, 0.0, None)
        if code == 0:
            self.compare(wanted)
        elif not (self.how == "damage" and code == REFUSED):
            self.faults.append(f"the last run ended with {code}")
        left = [
            path.name
            for path in [*self.folder.iterdir(), *self.scratch.iterdir()]
            if path.name.startswith(".strandline")
        ]
        if code == 0 and (self.folder / "out.zarr.checkpoint").exists():
            left.append("out.zarr.checkpoint")
        if left:
            self.faults.append(f"left {', '.join(left)}")
        return self

    def compare(self, wanted):
        found = digests(self.folder)
        differing = sorted(name for name in {*wanted, *found} if wanted.get(name) != found.get(name))
        differing = [name for name in differing if not name.startswith("out.zarr.checkpoint/")]
        if differing:
            self.faults.append(f"{len(differing)} files differ, as {differing[0]}")


def whole(program, arguments, place):
    """Seconds that a run takes that nobody ends, and what it gives."""
    folder = place / "whole"
    folder.mkdir()
    (place / "scratch").mkdir(exist_ok=True)
    started = time.monotonic()
    child = start(program, arguments, folder, place / "scratch", "10min")
    _, said = child.communicate()
    if child.returncode != 0:
        raise SystemExit(f"a run that nobody ended failed ({child.returncode}): {said.strip()}")
    seconds = time.monotonic() - started
    found = digests(folder)
    shutil.rmtree(folder)
    return seconds, found


def needed(program, arguments, place):
    """Bytes of disk that a run takes at most, of its output, its checkpoints and its temporary fields."""
    small = full_disk(place, 16 << 30)
    try:
        (small / "run").mkdir()
        (small / "scratch").mkdir()
        child = start(program, arguments, small / "run", small / "scratch", "100ms")
        most = 0
        while child.poll() is None:
            free = os.statvfs(small)
            most = max(most, (free.f_blocks - free.f_bfree) * free.f_frsize)
            time.sleep(0.01)
        child.communicate()
        if child.returncode != 0:
            raise SystemExit(f"a run that nobody ended failed ({child.returncode})")
        return most
    finally:
        unmount(small)
        small.rmdir()


def full_disk(place, size):
    """A folder with a disk of its own, of so many bytes."""
    small = place / "small"
    small.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(small)], check=True)
    return small


def unmount(small):
    subprocess.run(["umount", str(small)], check=True)


def enlarge(small, size):
    subprocess.run(["mount", "-o", f"remount,size={size}", str(small)], check=True)
