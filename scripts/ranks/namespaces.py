"""Two network namespaces of this machine, joined by a cable: ranks in them talk as on two machines. Needs root and iproute2.

Open MPI starts what runs in the other one by an agent in the place of ssh.
"""

import contextlib
import os
import shutil
import subprocess
from pathlib import Path

NET = "10.77.0"
NAMES = ("strandline-a", "strandline-b")
ENDS = ("strand-a", "strand-b")

AGENT = f"""#!/usr/bin/env bash
# What mpirun gives ssh: options, a host, a command.
while [[ $1 == -* ]]; do shift; done
case $1 in
    {NET}.1) name={NAMES[0]} ;;
    *) name={NAMES[1]} ;;
esac
shift
exec ip netns exec "$name" unshare -u bash -c "hostname $name; $*"
"""


def run(*words, check=True):
    """A command, without what it says."""
    return subprocess.run(words, check=check, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def can_be_made():
    """Whether there is all that they need."""
    return os.geteuid() == 0 and all(shutil.which(name) for name in ("ip", "unshare", "mpirun"))


@contextlib.contextmanager
def joined(folder):
    """Two namespaces for as long as it is asked for; gives what starts a program on so many ranks, half of them in each."""
    agent = Path(folder) / "agent"
    agent.write_text(AGENT)
    agent.chmod(0o755)
    try:
        for name in NAMES:
            run("ip", "netns", "add", name)
        run("ip", "link", "add", ENDS[0], "type", "veth", "peer", "name", ENDS[1])
        for number, (name, end) in enumerate(zip(NAMES, ENDS), 1):
            run("ip", "link", "set", end, "netns", name)
            run("ip", "-n", name, "addr", "add", f"{NET}.{number}/24", "dev", end)
            run("ip", "-n", name, "link", "set", end, "up")
            run("ip", "-n", name, "link", "set", "lo", "up")
        yield lambda ranks: launched(agent, ranks)
    finally:
        for name in NAMES:
            run("ip", "netns", "delete", name, check=False)


def launched(agent, ranks):
    """The words before a program's own."""
    half = (ranks + 1) // 2
    settings = {
        "mpi_yield_when_idle": "1",
        "plm_rsh_agent": str(agent),
        "oob_tcp_if_include": f"{NET}.0/24",
        "btl": "tcp,vader,self",
        "btl_tcp_if_include": f"{NET}.0/24",
    }
    # Each has a name of its own for the host, which mpirun tells machines apart by.
    line = ["ip", "netns", "exec", NAMES[0], "unshare", "-u", "bash", "-c", f'hostname {NAMES[0]}; exec "$@"', "mpirun"]
    line += ["mpirun", "--allow-run-as-root", "--bind-to", "none", "--host", f"{NET}.1:{half},{NET}.2:{half}"]
    for name, value in settings.items():
        line += ["--mca", name, value]
    return [*line, "-n", str(ranks)]
