"""Pictures for the page: three planes through an object with its marks, the truth and results as outlines."""

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from PIL import Image
from skimage import measure

# Voxels shown around an object.
MARGIN = 10
TRUTH, MARKS = "#ffd21f", "#ff3b30"
RESULTS = ("#35d0ff", "#7dff6a", "#ff8cf0")
NAMES = ("xy", "xz", "yz")


def draw(path, volume, number, outlines, answers):
    """`answers` are results by name, of which at most three are drawn."""
    box = around(volume.solid(number))
    outlines = [outline for outline in outlines if outline.object == number]
    middle = middles(volume, number, outlines)
    figure, panels = plt.subplots(1, 3, figsize=(9.6, 3.6), layout="constrained")
    for axis, (panel, name) in enumerate(zip(panels, NAMES)):
        plane(panel, volume, (axis, middle[axis]), box)
        border(panel, volume, volume.solid(number), (axis, middle[axis]), TRUTH)
        for color, answer in zip(RESULTS, answers.values()):
            border(panel, volume, volume.solid(number, answer.labels), (axis, middle[axis]), color)
        dots(panel, volume, outlines, (axis, middle[axis]))
        panel.set_title(name, fontsize=8)
        panel.set_axis_off()
    lines = [plt.Line2D([], [], color=color) for color in (TRUTH, *RESULTS[: len(answers)])]
    lines.append(plt.Line2D([], [], color=MARKS, marker="o", markersize=3, linestyle=""))
    figure.legend(lines, ["truth", *answers, "marks"], loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=90)
    plt.close(figure)
    # Few colours take a third of the bytes; chosen by how often they occur they would not be those of thin lines.
    picture = Image.open(path).convert("RGB")
    picture.quantize(palette=palette(), dither=Image.Dither.NONE).save(path, optimize=True)


def palette():
    """Greys, and the colours of lines on darker and lighter ground."""
    colors = [[level] * 3 for level in np.linspace(0, 255, 64).round().astype(int).tolist()]
    for line in (TRUTH, MARKS, *RESULTS):
        line = np.array(mpl.colors.to_rgb(line)) * 255
        colors += [(share * line + (1 - share) * ground).round().astype(int).tolist()
                   for ground in (0, 128, 255) for share in (1.0, 0.8, 0.6, 0.4)]
    image = Image.new("P", (1, 1))
    image.putpalette(sum(colors, []))
    return image


def middles(volume, number, outlines):
    """Index z, y, x of the middle of an object, z moved to the nearest slice that is marked."""
    middle = [round(float(np.mean(where))) for where in np.nonzero(volume.solid(number))]
    marked = [round(outline.points[0, 2] / volume.spacing[2]) for outline in outlines if outline.across == 2]
    middle[0] = min(marked, key=lambda z: abs(z - middle[0]), default=middle[0])
    return middle


def around(mask):
    """Slices z, y, x around a mask, and a margin."""
    return tuple(
        slice(max(int(where.min()) - MARGIN, 0), min(int(where.max()) + MARGIN + 1, size))
        for where, size in zip(np.nonzero(mask), mask.shape)
    )


def in_plane(volume, axis):
    """The two array axes of a plane across `axis`, downwards and to the right, and their steps."""
    axes = [a for a in range(3) if a != axis]
    return axes, [volume.spacing[2 - a] for a in axes]


def plane(panel, volume, where, box):
    axis, index = where
    axes, steps = in_plane(volume, axis)
    image = volume.image.take(index, axis=axis)[tuple(box[a] for a in axes)]
    low, high = np.percentile(image, (1, 99.7))
    (top, left), (down, right) = [box[a].start for a in axes], [box[a].stop for a in axes]
    edges = (np.array([left, right, down, top]) - 0.5) * [steps[1], steps[1], steps[0], steps[0]]
    panel.imshow(image, cmap="gray", vmin=low, vmax=high, extent=edges, interpolation="nearest")
    panel.set(xlim=edges[:2], ylim=edges[2:])


def border(panel, volume, mask, where, color):
    axis, index = where
    _, steps = in_plane(volume, axis)
    flat = np.pad(mask.take(index, axis=axis), 1).astype(float)
    for loop in measure.find_contours(flat, 0.5):
        row, column = ((loop - 1) * steps).T
        panel.plot(column, row, color=color, linewidth=1.2)


def dots(panel, volume, outlines, where):
    """Marks within half a voxel of the plane, in their places."""
    axis, index = where
    axes, _ = in_plane(volume, axis)
    for outline in outlines:
        near = np.abs(outline.points[:, 2 - axis] - index * volume.spacing[2 - axis]) <= 0.5 * volume.spacing[2 - axis]
        panel.plot(outline.points[near, 2 - axes[1]], outline.points[near, 2 - axes[0]], ".", color=MARKS, markersize=3)
