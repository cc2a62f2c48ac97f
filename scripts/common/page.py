"""Markdown: tables, the machine, and pages of which a script writes a part."""

import datetime
import os
import platform
import subprocess
from pathlib import Path

ROOT = Path(os.environ.get("STRANDLINE_ROOT", Path(__file__).resolve().parents[2]))


def table(header, rows):
    """A Markdown table; None is an empty place."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join("" if cell is None else str(cell) for cell in line) + " |" for line in lines)


def circumstances(version):
    """Program version, date and machine, one sentence each."""
    commit = _output("git", "-C", ROOT, "rev-parse", "--short", "HEAD")
    state = f" at commit {commit}" if commit else ""
    return f"strandline {version}{state}; {datetime.date.today().isoformat()}; {machine()}."


def machine():
    """Processor, how many of it, memory, kernel, of this machine."""
    cpu = next(
        (line for line in _lines("/proc/cpuinfo") if line.startswith("model name")), "model name: unknown processor"
    )
    vector = "AVX-512" if any("avx512f" in line for line in _lines("/proc/cpuinfo")) else "no AVX-512"
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    name = cpu.partition(":")[2].strip()
    cores = len(os.sched_getaffinity(0))
    return f"{name} ({vector}), {cores} cores, {memory:.0f} GiB, Linux {platform.release().split('-')[0]}"


def write_part(path, name, text):
    """Replaces what stands between the page's marks for `name`; a page without them is given them at its end."""
    begin, end = f"<!-- from here: written by {name} -->", f"<!-- to here: written by {name} -->"
    page = path.read_text(encoding="utf-8") if path.exists() else ""
    before, found, rest = page.partition(begin)
    after = rest.partition(end)[2] if found else "\n"
    if not found and before:
        before = before.rstrip() + "\n\n"
    path.parent.mkdir(exist_ok=True)
    path.write_text(f"{before}{begin}\n\n{text.strip()}\n\n{end}{after}", encoding="utf-8")


def _lines(path):
    try:
        return Path(path).read_text().splitlines()
    except OSError:
        return []


def _output(*command):
    try:
        return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""
