"""One run of the program in a folder, with a time limit, and what it did to the folder's inputs."""

import hashlib
import os
import shlex
import shutil
import signal
import stat
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

# What Rust's runtime ends with after a panic.
PANIC = 101
# A case is a folder with a file of this name: the arguments of one run a line.
COMMANDS = "cmd"


@dataclass
class Run:
    """A finished run. `code` is negative for a signal, None when the time was up."""

    case: str
    line: str
    code: int | None
    seconds: float
    out: str
    err: str
    changed: list = field(default_factory=list)

    @property
    def faults(self):
        """What no run may do, whatever its input is."""
        found = []
        if self.code is None:
            found.append("hung")
        elif self.code < 0:
            found.append(f"killed ({signal_name(-self.code)})")
        if self.code == PANIC or "panicked at" in self.err:
            found.append("panicked")
        if self.changed:
            found.append(f"changed its input {', '.join(self.changed)}")
        return found


def signal_name(number):
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def cases(folder):
    """Folders with commands, below `folder` or itself, by name."""
    return sorted(path.parent for path in Path(folder).rglob(COMMANDS) if path.is_file())


def commands(case):
    """Runs of a case: lines that are neither empty nor comments."""
    lines = (case / COMMANDS).read_text(encoding="utf-8").splitlines()
    return [line.strip() for line in lines if line.strip() and not line.lstrip().startswith("#")]


def copy(case, place):
    """A copy of a case that may be written to, also where the case may not; links stay links."""
    shutil.copytree(case, place, symlinks=True)
    for path in [place, *place.rglob("*")]:
        if not path.is_symlink():
            path.chmod(path.stat().st_mode | stat.S_IWUSR)


def digests(folder):
    """What each file holds, by its path in the folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).digest() for path in files}


def run(program, name, line, folder, limit):
    """Runs one line in `folder`. All processes that it started end with it."""
    started = time.monotonic()
    child = subprocess.Popen(
        [program, *shlex.split(line)],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        text=True,
        errors="replace",
    )
    try:
        out, err = child.communicate(timeout=limit)
        code = child.returncode
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)
        out, err = child.communicate()
        code = None
    return Run(name, line, code, time.monotonic() - started, out, err)


def changes(before, folder):
    """Files that were there before a run and are not as they were."""
    after = digests(folder)
    return [path for path, digest in before.items() if after.get(path) != digest]
