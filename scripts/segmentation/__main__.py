"""scripts/compare_segmentation: objects from border points by this program and by others, into docs/segmentation.md."""

import argparse
import os
import signal
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from common import page
from common.program import Program

from . import foam, made, nuclei, ours, parts, real, tissue

TITLE = """# Segmentation compared

Objects from border points where the truth is known: this program, and other ways from the same marks to an object.
`scripts/compare_segmentation` runs this and writes this page, part by part.

    scripts/compare_segmentation                                            # everything
    scripts/compare_segmentation --print --data mouse --marks every4 --no-peers   # a quick look, nothing written
"""
# What makes each stack, by part of the page.
OBJECTS = {"mouse": real.mouse, "nuclei": nuclei.make, "tissue": tissue.make, "embryo": real.embryo}
TOUCHING = {"foam": foam.make}
STACKS = {"objects": OBJECTS, "surfaces": made.names(), "touching": TOUCHING, "pictures": OBJECTS | TOUCHING}
OURS = ["default=", "image none=--image none"]
# Of cells that touch, as a tissue is to come out.
FILLED = "fill gaps=--fill-gaps auto"


def comma(text):
    return text.split(",")


def marks(text):
    try:
        return parts.checked(comma(text))
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def arguments():
    parser = argparse.ArgumentParser(prog="scripts/compare_segmentation", description=__doc__)
    parser.add_argument("--only", choices=STACKS, action="append", help="only this part; may be repeated (all)")
    parser.add_argument(
        "--data",
        type=comma,
        help="only these stacks, by name or first word of it: mouse,sphere-wall,lobed,made,foam (all)",
    )
    parser.add_argument(
        "--marks",
        type=marks,
        help="only these marks: every2,every4-p20,three-j1.5,planes,every8+planes (each part's own)",
    )
    parser.add_argument("--seeds", type=int, default=1, metavar="N", help="average over N jitters (1)")
    parser.add_argument(
        "--ours",
        action="append",
        metavar="NAME=FLAGS",
        help=f"a setting of this program; may be repeated ({', '.join(OURS)})",
    )
    parser.add_argument("--no-peers", action="store_true", help="this program only")
    parser.add_argument("--peers", type=comma, help="only these other methods, e.g. SDF,RBF (all)")
    parser.add_argument("--print", action="store_true", help="print the tables and write nothing")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="keep stacks, marks and stores there")
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="threads of this program (1)")
    folder = os.environ.get("STRANDLINE_DATA", page.ROOT.parent / "shared" / "data")
    parser.add_argument(
        "--folder", type=Path, default=Path(folder), help="test data ($STRANDLINE_DATA, ../shared/data)"
    )
    parser.add_argument(
        "--out", type=Path, default=page.ROOT / "docs" / "segmentation.md", help="page (docs/segmentation.md)"
    )
    return parser.parse_args()


def methods(settings, program, part):
    """What to compare on a part of the page, by name."""
    found = {}
    if not settings.no_peers:
        # What peers import takes seconds that a quick look does not need.
        from . import peers

        wanted = [name for name in peers.PEERS if not settings.peers or name in settings.peers]
        peers.load(wanted)
        found = {name: partial(peers.solve, peers.PEERS[name]) for name in wanted}
    for text in settings.ours or OURS + [FILLED] * (part == "touching"):
        name, _, flags = text.partition("=")
        found[name] = partial(run_ours, program, f"{flags} --threads {settings.jobs}")
    return found


def run_ours(program, flags, volume, _outlines, folder):
    return ours.segment(program, volume, folder, flags)


def chosen(stacks, wanted, part):
    """Names of a part's stacks that were asked for."""
    family = {"surfaces": "made"}.get(part)
    return [name for name in stacks if not wanted or {name, name.partition("-")[0], family} & set(wanted)]


def volumes(settings, part):
    """The part's stacks, made or read one at a time."""
    for name in chosen(STACKS[part], settings.data, part):
        volume = STACKS[part][name](settings.folder)
        if volume is None:
            print(f"  {name}: not in {settings.folder}, left out", flush=True)
            continue
        yield volume


def main():
    settings = arguments()
    # So that temporary stores go also when the run is ended from outside.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    program = Program()
    if not settings.print and not settings.out.exists():
        settings.out.parent.mkdir(parents=True, exist_ok=True)
        settings.out.write_text(TITLE + "\n", encoding="utf-8")
    with tempfile.TemporaryDirectory() as scratch:
        place = settings.keep or Path(scratch)
        pictures = settings.out.parent / "pictures"
        # A quick look draws nothing unless it is told to.
        wanted = settings.only or [name for name in STACKS if name != "pictures" or not settings.print]
        for name in wanted:
            if not chosen(STACKS[name], settings.data, name):
                continue
            started = time.monotonic()
            setting = parts.Setting(methods(settings, program, name), settings.marks, settings.seeds, place, pictures)
            text = parts.PARTS[name](setting, volumes(settings, name))
            if settings.print:
                print(f"\n{text}\n", flush=True)
                continue
            minutes = (time.monotonic() - started) / 60
            head = f"{page.circumstances(program.version())} This part took {minutes:.0f} minutes."
            page.write_part(settings.out, f"scripts/compare_segmentation --only {name}", f"{text}\n\n{head}")


if __name__ == "__main__":
    main()
