"""A run of the program, what memory it took, and whether it kept what it was allowed."""

import os
import re
import signal
import subprocess
import threading
from dataclasses import dataclass

MIB = 1 << 20
# A run that was refused with so many times the memory that it takes when it has all of it was refused for little.
NEEDLESS = 3
# Commands without --memory may take so much.
UNLIMITED = 1024 * MIB


@dataclass
class Run:
    """A finished run: its exit code, negative for a signal, what it said, the most memory it had resident."""

    code: int
    said: str
    peak: int
    hung: bool = False

    @property
    def stages(self):
        """Stages that it told as done: it had begun to work."""
        return len(re.findall(r"^.*  done  ", self.said, re.MULTILINE))

    @property
    def error(self):
        lines = [line for line in self.said.splitlines() if line.startswith("strandline: ")]
        return lines[-1].removeprefix("strandline: ") if lines else self.said.strip()[-200:]


def run(program, arguments, folder, seconds):
    """Runs the program in a folder. What is told of a child starts with what its parent had, so this one must be small."""
    with (folder / "said").open("w+b") as said:
        child = subprocess.Popen(
            [program, *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said
        )
        hung = threading.Event()
        watch = threading.Timer(seconds, lambda: (hung.set(), child.send_signal(signal.SIGKILL)))
        watch.start()
        _, status, usage = os.wait4(child.pid, 0)
        watch.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        text = said.read().decode(errors="replace")
    return Run(child.returncode, text, usage.ru_maxrss * 1024, hung.is_set())


def least(program, arguments, folder, seconds):
    """The least memory with which a job is not refused, by its own account; none where it is refused for another reason."""
    # No run does with that little. Inputs that are too large to be read are told before what the run takes.
    memory = None
    asked = run(program, [*arguments, "--dry-run", "--memory", "100MiB"], folder, seconds)
    while told := re.search(r"--memory (\d+)MiB", asked.error):
        memory = int(told[1]) * MIB
        asked = run(program, [*arguments, "--dry-run", "--memory", str(memory)], folder, seconds)
        if asked.code == 0:
            break
    return memory, asked


def verdict(run, limit, least):
    """What came of a run: `finished`, `refused`, or what it must not do."""
    if run.hung:
        return "hung"
    if run.code < 0 or run.code == 101 or "panicked at" in run.said:
        return f"died with {run.code}"
    if run.peak > limit:
        return "over"
    if run.code in (0, 3):
        return "finished"
    if "--memory" not in run.error:
        return "unusable"
    if run.stages:
        return "refused late"
    return "refused" if limit < least else "refused against its word"
