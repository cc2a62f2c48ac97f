"""One trial on several ranks: a run by mpirun of which a rank, or all, are ended, gone on with on other numbers of ranks."""

import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from interrupting import runs

from . import trials

# Numbers of ranks; runs that are gone on with have another one than the run before.
RANKS = (1, 2, 3, 5)
# Whatever happens to one rank, all have ended after so many seconds.
LATEST = 10.0
HOWS = ("kill", "term", "panic", "disk")


def launched(program, ranks):
    """What starts a program on so many ranks of one thread."""
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    # What mpirun itself keeps in files: on a disk that is full it hangs before there are any ranks.
    own = ["--mca", "orte_tmpdir_base", tempfile.gettempdir()]
    return ["mpirun", *root, *own, "--oversubscribe", "--bind-to", "none", "-n", str(ranks), program]


def processes(program, folder):
    """The processes of a program that work in a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if (process / "exe").readlink() == Path(program) and (process / "cwd").readlink() == folder:
                found.append(int(process.name))
        except OSError:
            continue
    return sorted(found)


class RankTrial(trials.Trial):
    """A run on several ranks, ended as `how` says."""

    ranks = 0

    def begin(self, resume, panic):
        """The run, on another number of ranks than the one before."""
        self.ranks = self.numbers.choice([ranks for ranks in RANKS if ranks != self.ranks])
        every = f"{self.numbers.choice([20, 50, 100, 300])}ms"
        line = [*launched(self.program, self.ranks)[1:], *self.arguments, "--threads", "1", "--memory", "2GiB"]
        line += ["--checkpoint-every", every, *(["--resume"] if resume else [])]
        told = f"{self.numbers.randrange(self.ranks)} {panic:.3f}" if panic is not None else ""
        os.environ["STRANDLINE_PANIC"] = told
        return runs.start("mpirun", line, self.folder, self.scratch)

    def once(self, resume, moment, sent):
        """One run, ended after a while if it is not done by then; its code."""
        child = self.begin(resume, moment if sent and self.how == "panic" else None)
        asked = None
        if sent is not None:
            try:
                child.wait(timeout=moment)
            except subprocess.TimeoutExpired:
                if self.how == "term":
                    child.send_signal(signal.SIGTERM)
                # In the first moments there is no rank yet.
                if self.how == "term" or (self.how == "kill" and self.kill_one()):
                    asked = time.monotonic()
        try:
            _, said = child.communicate(timeout=None if asked is None else 60)
        except subprocess.TimeoutExpired:
            child.kill()
            _, said = child.communicate()
            self.faults.append("hung")
        if asked and time.monotonic() - asked > LATEST:
            self.faults.append(f"took {time.monotonic() - asked:.1f} s to end")
        if left := self.left_running():
            self.faults.append(f"{len(left)} processes go on")
        self.said.append(said.strip())
        self.steps.append(f"{self.ranks} ranks, {moment:.2f} s: {child.returncode}")
        return child.returncode

    def kill_one(self):
        """SIGKILL to a rank, where there are some; whether there were."""
        ranks = processes(self.program, self.folder)
        if ranks:
            os.kill(self.numbers.choice(ranks), signal.SIGKILL)
        return bool(ranks)

    def left_running(self):
        """Processes that are there a moment after the launcher has ended."""
        for _ in range(20):
            if not processes(self.program, self.folder):
                return []
            time.sleep(0.1)
        return processes(self.program, self.folder)

    def ended(self, wanted):
        """Ends the run once to three times; whether it was done before."""
        for turn in range(self.numbers.randint(1, 3)):
            code = self.once(turn > 0, self.numbers.uniform(0.2, 1.5 * self.seconds + 0.5), signal.SIGKILL)
            if code == 0:
                return True
            # A launcher that is terminated may not pass on what ranks say last.
            if not self.said[-1] and self.how != "term":
                self.faults.append("it ended without a word")
            self.look_at_unfinished(wanted)
        return False
