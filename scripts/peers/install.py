"""Environments for the programs to be measured; what does not install is remembered, and the rest goes on."""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
DEBIAN = Path("/usr/bin/python3")
GROUPS = ("numpy2", "numpy1")


def environments(target):
    """Python of each group, and `{package: last line of pip}` of those that did not install."""
    pythons, failures = {}, {}
    for group in GROUPS:
        venv = target / f"venv-peers-{group}"
        wanted = HERE / f"peers-{group}.txt"
        done = venv / "installed.txt"
        pythons[group] = venv / "bin" / "python"
        if not done.exists() or done.read_text().partition("\n--\n")[0] != wanted.read_text():
            subprocess.run([sys.executable, "-m", "venv", "--clear", str(venv)], check=True)
            failed = [line for line in requirements(wanted) if not install(pythons[group], line)]
            done.write_text(wanted.read_text() + "\n--\n" + "\n".join(failed))
        for line in done.read_text().partition("\n--\n")[2].split():
            name = line.partition("==")[0]
            hint = "; Debian has it as python3-openvdb" if name == "openvdb" else ""
            failures[name] = f"not run: pip could not install it{hint}"
    if "openvdb" in failures and debian_has_openvdb():
        pythons["openvdb"] = DEBIAN
        del failures["openvdb"]
    return pythons, failures


def debian_has_openvdb():
    """True when the system's own Python has Debian's python3-openvdb: PyPI has no OpenVDB."""
    command = [str(DEBIAN), "-c", "import pyopenvdb, numpy"]
    return DEBIAN.exists() and subprocess.run(command, capture_output=True).returncode == 0


def requirements(path):
    return [line for line in path.read_text().splitlines() if line and not line.startswith("#")]


def install(python, line):
    """True when pip could install it; wheels where there are any."""
    print(f"installing {line}", flush=True)
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--prefer-binary", line]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        print(f"  {(done.stderr.strip().splitlines() or ['failed'])[-1]}", flush=True)
    return done.returncode == 0
