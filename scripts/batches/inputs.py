"""Small stacks with a bright ball, marks on its border, and stacks that are broken in different ways."""

import math
import random
import struct

SIDE = 72
SPACING = 0.5


def write_tiff(path, pages, side):
    """Writes pages of 16-bit grey values, uncompressed, as ImageJ does, with a spacing."""
    told = f"ImageJ=1.54f\nimages={len(pages)}\nslices={len(pages)}\nunit=um\nspacing={SPACING}\n"
    description = told.encode() + b"\0"
    out = bytearray(b"II*\0")
    out += struct.pack("<I", 0)
    shared = len(out)
    out += description + b"\0" * (len(description) % 2)
    resolution = len(out)
    out += struct.pack("<II", round(1 / SPACING * 1000), 1000)
    link = 4
    for page in pages:
        data = len(out)
        out += page
        entries = [
            (256, 4, 1, side), (257, 4, 1, side), (258, 3, 1, 16), (259, 3, 1, 1), (262, 3, 1, 1),
            (270, 2, len(description), shared), (273, 4, 1, data), (277, 3, 1, 1), (278, 4, 1, side),
            (279, 4, 1, len(page)), (282, 5, 1, resolution), (283, 5, 1, resolution),
        ]  # fmt: skip
        struct.pack_into("<I", out, link, len(out))
        out += struct.pack("<H", len(entries))
        for entry in entries:
            out += struct.pack("<HHII", *entry)
        link = len(out)
        out += struct.pack("<I", 0)
    path.write_bytes(out)


def write_ball(folder, name, seed, side=SIDE):
    """A ball in noise, and marks on every fourth slice, in lengths."""
    numbers = random.Random(seed)
    centre = [side / 2 + numbers.uniform(-3, 3) for _ in range(3)]
    radius = side * numbers.uniform(0.27, 0.33)
    noise = [100 + numbers.randrange(40) for _ in range(4 * side)]
    pages = []
    for z in range(side):
        page = []
        for y in range(side):
            shift = numbers.randrange(3 * side)
            row = noise[shift : shift + side]
            inside = radius**2 - (z - centre[2]) ** 2 - (y - centre[1]) ** 2
            if inside > 0:
                half = math.sqrt(inside)
                low, high = math.ceil(centre[0] - half), math.floor(centre[0] + half) + 1
                row[low:high] = [value + 300 for value in row[low:high]]
            page.append(struct.pack(f"<{side}H", *row))
        pages.append(b"".join(page))
    write_tiff(folder / f"{name}.tif", pages, side)
    lines = ["object,contour,x,y,z"]
    for z in range(0, side, 4):
        square = radius**2 - (z - centre[2]) ** 2
        if square < 0.1 * radius**2:
            continue
        for n in range(24):
            x, y = (centre[a] + math.sqrt(square) * f(n * math.tau / 24) for a, f in enumerate((math.cos, math.sin)))
            lines.append(f"1,{z},{x * SPACING:.6f},{y * SPACING:.6f},{z * SPACING:.6f}")
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def spoil(folder, names):
    """Breaks five items, each in another way; returns their names."""
    cut, no_tiff, no_marks, outside, crossed = names
    image = folder / f"{cut}.tif"
    image.write_bytes(image.read_bytes()[: SIDE * SIDE * 20])
    (folder / f"{no_tiff}.tif").write_bytes(b"no image at all")
    (folder / f"{no_marks}.csv").write_text("object,contour,x,y,z\n")
    marks = folder / f"{outside}.csv"
    head, *lines = marks.read_text().splitlines()
    moved = [line.split(",") for line in lines]
    marks.write_text("\n".join([head, *(",".join([*m[:2], str(float(m[2]) + 1e4), *m[3:]]) for m in moved)]) + "\n")
    (folder / f"{crossed}.csv").write_text("object,contour,x,y,z\n1,0,one,2,3\n")
    return list(names)


def write_list(path, theta=None):
    """The list: a ball each, one distance whose grid needs more memory than there is; theta is a setting of one."""
    text = '[defaults]\ncommand = "segment"\npoints = "in/{stem}.csv"\n\n'
    text += '[[items]]\nimages = "in/[b-z]*.tif"\n\n[[items]]\nimages = "in/a01.tif"\n'
    text += f"theta = {theta}\n" if theta else ""
    text += '\n[[items]]\nimages = "in/a0[02-9].tif"\n'
    text += '\n[[items]]\ncommand = "distance"\nsources = "marks.csv"\nname = "large"\nspacing = 0.05\n'
    # All voxels in one heap in memory.
    text += 'method = "fmm"\nschedule = "sweep"\n'
    path.write_text(text)
