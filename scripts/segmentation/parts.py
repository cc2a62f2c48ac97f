"""The parts of the page: objects, made surfaces, touching cells, pictures. Each runs its stacks and returns Markdown."""

from dataclasses import dataclass
from pathlib import Path

from . import foam, scores
from .marks import kind, mark
from .report import Table, dice_cell, radial_cell, seconds_cell, share_cell, signed_share_cell, worst_cell
from .volume import write_outlines

STANDARD = ["every2", "every4", "every8", "three", "planes", "every2-p8", "every2-p20", "every2-j1.5"]

STACKS_TOLD = """\
- `mouse`: 8 nuclei of a mouse embryo, 1 : 1 : 2.18, truth by its authors; no part of this project
- `nuclei`: 16 nuclei, made to look like those
- `tissue`: 18 cells with walls that fade and gap, made, 0.35 : 0.35 : 0.8
- `embryo`: two nested tissues, made, marked on all slices or on every sixth

Marks: `every2` is every second slice of an object, `three` three slices of it, `planes` an xz and a yz plane through its middle; 12 points a
contour (`-p8`: 8) with jitter of half a voxel (`-j1.5`: 1.5). Other ways from the same marks: `SDF`, outlines interpolated by signed distances;
`ITK`, morphological contour interpolation; `RBF`, r^3 through points beside the outlines too, and smoothed; `random walker` (scikit-image) and
`geodesic` (ITK's active contour), which look at the image from what SDF gives. Empty: such marks are not for that way."""


@dataclass
class Setting:
    """One run of the script: `methods[name](volume, outlines, folder)` gives an Answer, or None for marks it cannot use."""

    methods: dict
    marks: list | None
    seeds: int
    scratch: Path
    pictures: Path | None = None


def answers(setting, volume, standard):
    """(marks, method, answer) of all runs on a volume; `standard` are the marks of volumes without their own."""
    place = setting.scratch / volume.name
    place.mkdir(parents=True, exist_ok=True)
    volume.write(place / "stack.tif")
    names = setting.marks or list(volume.given) or standard
    for name in names:
        if name not in volume.given and volume.given:
            print(f"  {volume.name}: no marks {name}, only {', '.join(volume.given)}", flush=True)
            continue
        for seed in range(8, 8 + (1 if name in volume.given else setting.seeds)):
            outlines = volume.given.get(name) or mark(volume, name, seed)
            for method, solve in setting.methods.items():
                folder = place / f"{name}-{seed}" / method.replace(" ", "-")
                folder.mkdir(parents=True, exist_ok=True)
                write_outlines(folder / "marks.csv", outlines)
                answer = solve(volume, outlines, folder)
                if answer is None:
                    continue
                note = f": {answer.note}" if answer.note else ""
                print(f"  {volume.name} {name} {seed}: {method}, {answer.seconds:.1f} s{note}", flush=True)
                yield name, method, answer


def objects(setting, volumes):
    """Overlap of each object with the truth."""
    overlap, seconds = (Table(setting.methods, "stack", "marks") for _ in range(2))
    for volume in volumes:
        for name, method, answer in answers(setting, volume, STANDARD):
            overlap.add((volume.name, name), method, scores.dice(volume, answer))
            seconds.add((volume.name, name), method, answer.seconds)
    return (
        f"## Objects\n\n{STACKS_TOLD}\n\nDice with the truth, mean over the objects that were solved:\n\n"
        f"{overlap.markdown(dice_cell)}\n\nThe worst object that was solved:\n\n{overlap.markdown(worst_cell)}\n\n"
        f"Seconds for all objects:\n\n{seconds.markdown(seconds_cell)}"
    )


def surfaces(setting, volumes):
    """Radial error of made surfaces."""
    table = Table(setting.methods, "stack")
    for volume in volumes:
        for _, method, answer in answers(setting, volume, []):
            mesh = answer.surfaces.get(1)
            found = scores.radial(volume.surface, mesh) if mesh is not None and len(mesh[1]) else None
            table.add((volume.name,), method, found)
    return (
        "## Surfaces that are known\n\nWhat the surface found lies beyond the true one along its radius, in voxels: root mean square / "
        f"mean (positive: outside).\n\n{table.markdown(radial_cell)}"
    )


def touching(setting, volumes):
    """Walls that cells share."""
    table = Table(setting.methods, "stack", "marks", "figure")
    for volume in volumes:
        for name, method, answer in answers(setting, volume, ["three-p14", "every4-p14", "every2-p14"]):
            row = (volume.name, name)
            empty, wrong, twice = foam.between(volume, answer)
            table.add((*row, "Dice"), method, (dice_cell, scores.dice(volume, answer)))
            for label, value in (("no label", empty), ("wrong cell", wrong), ("two objects", twice)):
                table.add((*row, label), method, (share_cell, value))
            found = foam.read_contacts(answer.store)
            if found is not None:
                error, together, missed, made_up = foam.contact_error(volume, found)
                table.add((*row, "contact areas off by"), method, (share_cell, error))
                table.add((*row, "all contacts together"), method, (signed_share_cell, together))
                table.add((*row, "contacts missed"), method, (seconds_cell, missed))
                table.add((*row, "contacts made up"), method, (seconds_cell, made_up))
    return (
        "## Touching cells\n\nOf the voxels of cells that lie within 3 voxels of a wall between two: without a label, with the label of a "
        "wrong cell, held by two objects' level sets. Contact areas beside those of the true diagram: differences of each, summed, and of all together.\n\n"
        f"{table.markdown(lambda runs: runs[0][0]([value for _, value in runs]))}"
    )


# What is drawn: stack, marks, the object's number.
SHOWN = (
    ("mouse", "every4", 5),
    ("nuclei", "three", 3),
    ("tissue", "every4", 9),
    ("embryo", "sixth", 2),
    ("foam", "three-p14", 15),
)


def drawn(setting, volumes):
    """Pictures of a few objects: truth, marks, the first setting of this program, and interpolation of outlines."""
    # Only here: what draws takes a second to load.
    from . import pictures

    shown, lines = {name: (marks, number) for name, marks, number in SHOWN}, []
    ours = next(name for name, solve in setting.methods.items() if solve.func.__module__ != "segmentation.peers")
    names = [ours, *(name for name in ("SDF",) if name in setting.methods)]
    for volume in volumes:
        marks, number = shown[volume.name]
        only = Setting({name: setting.methods[name] for name in names}, [marks], 1, setting.scratch)
        answered = {method: answer for _, method, answer in answers(only, volume, [])}
        path = setting.pictures / f"segmentation-{volume.name}.png"
        outlines = volume.given.get(marks) or mark(volume, marks, 8)
        pictures.draw(path, volume, number, outlines, answered)
        lines.append(f"`{volume.name}`, marks `{marks}`, object {number}:\n\n![{volume.name}](pictures/{path.name})")
    return "## Pictures\n\nThree planes through the middle of an object.\n\n" + "\n\n".join(lines)


PARTS = {"objects": objects, "surfaces": surfaces, "touching": touching, "pictures": drawn}


def checked(names):
    """Names of marks, each known as a kind or as marks that a stack brings."""
    for name in names:
        if name not in ("all", "sixth", "exact"):
            kind(name)
    return names
