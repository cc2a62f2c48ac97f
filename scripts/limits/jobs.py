"""Random jobs: arguments of the program, without limits, and how their inputs are made."""

import math
from dataclasses import dataclass, field

from . import inputs

METHODS = ("fsm", "vdt", "fmm", "dp")
OUTPUTS = ["-o", "out.zarr"], ["-o", "none"]


@dataclass
class Job:
    """A job: its arguments, and calls `make(folder, rng)` of which each writes an input."""

    arguments: list
    makes: list = field(default_factory=list)
    # Whether the command takes --memory, --threads and the like.
    is_limited: bool = True


def within(numbers, low, high):
    """A number whose logarithm is uniform."""
    return math.exp(numbers.uniform(math.log(low), math.log(high)))


def some(numbers, chance, *flags):
    """The flags, or none."""
    return list(flags) if numbers.random() < chance else []


def volume_shape(numbers, low, high):
    """A shape of so many voxels in all, of any proportions."""
    voxels = within(numbers, low, high)
    sides = [numbers.uniform(0.5, 2) for _ in range(3)]
    scale = (voxels / math.prod(sides)) ** (1 / 3)
    return [max(8, int(scale * side)) for side in sides]


def volume_name(numbers, name):
    return name + numbers.choice([".tif", ".zarr"])


def geometry(numbers, job, number, kind):
    """Adds a source: a cloud or a mesh, beside the others."""
    centre = (2.2 * number, 0.1 * number, 0)
    if kind == "mesh":
        name, size = f"mesh-{number}.obj", within(numbers, 100, 100_000)
        job.makes.append(lambda folder, rng: inputs.mesh(folder / name, rng, size, centre))
    else:
        name, size = f"cloud-{number}.csv", int(within(numbers, 10, 200_000))
        shape = numbers.choice(["ball", "torus", "spread", "bowl"])
        job.makes.append(lambda folder, rng: inputs.cloud(folder / name, rng, size, centre, shape))
    job.arguments.append(name)


def label_volume(numbers, job):
    """Adds a volume of labels."""
    name, shape, count = volume_name(numbers, "labels"), volume_shape(numbers, 1e5, 4e6), numbers.randint(2, 12)
    job.makes.append(lambda folder, rng: inputs.labels(folder / name, rng, shape, count))
    job.arguments.append(name)


def distance_grid(numbers, sources):
    """A grid around the sources, or one that some or all of them lie outside of; 3e5 voxels to 1e7."""
    voxels = within(numbers, 3e5, 1e7)
    width = 2.2 * sources + 1
    spacing = (width * 9 / voxels) ** (1 / 3)
    if numbers.random() < 0.7:
        return ["--spacing", f"{spacing:.5f}", *some(numbers, 0.3, "--padding", f"{numbers.uniform(0, 1):.3f}")]
    origin = ",".join(f"{numbers.uniform(-1.5, 1.5):.3f}" for _ in range(3))
    shape = volume_shape(numbers, voxels / 2, voxels)
    return [f"--origin={origin}", "--spacing", f"{spacing:.5f}", "--shape", ",".join(map(str, shape))]


def distance_flags(numbers):
    """Method, schedule, precision and the like of a distance."""
    method = numbers.choice(METHODS)
    schedule = numbers.choice(["front", "front", "sweep"])
    flags = ["--method", method, "--schedule", schedule]
    flags += ["--precision", numbers.choice(["f16", "f32", "f32", "f64"])]
    flags += some(numbers, 0.4, "--init", numbers.choice(["cell", "contiguous", "grid"]))
    if schedule == "front":
        flags += some(numbers, 0.2, "--max-distance", f"{numbers.uniform(0.1, 2):.3f}")
        if method in ("vdt", "dp"):
            flags += some(numbers, 0.3, "--neighbours", "26")
    return flags + some(numbers, 0.3, "--ranks", str(numbers.randint(2, 3)))


def distance(numbers):
    job = Job(["distance"])
    is_signed, count = numbers.random() < 0.2, numbers.randint(1, 3)
    if not is_signed and numbers.random() < 0.2:
        label_volume(numbers, job)
    else:
        for number in range(count):
            geometry(numbers, job, number, "mesh" if is_signed else numbers.choice(["cloud", "mesh"]))
        job.arguments += distance_grid(numbers, count)
    job.arguments += distance_flags(numbers) + ["--signed"] * is_signed
    job.arguments += some(numbers, 0.4, "--labels") + some(numbers, 0.3, "--closest-point")
    job.arguments += numbers.choice(OUTPUTS)
    return job


def middle(numbers):
    job, count = Job(["middle"]), numbers.randint(2, 4)
    if numbers.random() < 0.3:
        label_volume(numbers, job)
    else:
        for number in range(count):
            geometry(numbers, job, number, numbers.choice(["cloud", "mesh"]))
        job.arguments += ["--spacing", f"{(19.8 * count / within(numbers, 5e4, 1e6)) ** (1 / 3):.5f}"]
        job.arguments += some(numbers, 0.2, "--surface", "labels") if count == 2 else []
    job.arguments += distance_flags(numbers) + some(numbers, 0.3, "--labels", "exact")
    job.arguments += numbers.choice(OUTPUTS) + some(numbers, 0.4, "--mesh", "out." + numbers.choice(["ply", "stl", "vtp"]))
    return job


def reconstruct(numbers):
    size, shape = int(within(numbers, 200, 12_000)), numbers.choice(["ball", "torus", "bowl"])
    job = Job(["reconstruct", "cloud.csv"])
    job.makes.append(lambda folder, rng: inputs.cloud(folder / "cloud.csv", rng, size, (0, 0, 0), shape))
    job.arguments += some(numbers, 0.3, "--spacing", f"{within(numbers, 0.8, 2.5) / math.sqrt(size):.5f}")
    job.arguments += some(numbers, 0.2, "--method", numbers.choice(METHODS)) + ["--max-steps", "8"]
    job.arguments += some(numbers, 0.3, "--ranks", str(numbers.randint(2, 3)))
    job.arguments += some(numbers, 0.3, "--beta", f"{numbers.uniform(2, 5) / math.sqrt(size):.5f}")
    job.arguments += numbers.choice(OUTPUTS) + some(numbers, 0.4, "--mesh", "out." + numbers.choice(["ply", "obj", "stl"]))
    return job


def crop(numbers, shape):
    """A part of a volume that holds its middle."""
    parts = []
    for n in reversed(shape):
        parts.append(f"{numbers.randint(0, n // 8)}:{numbers.randint(n - n // 8, n)}")
    return ",".join(parts)


def segment(numbers):
    name, objects = volume_name(numbers, "stack"), numbers.choice([1, 1, 2, 3, 6])
    shape = volume_shape(numbers, 1e5, 8e6)
    dtype, wide = numbers.choice(["u1", "u2", "f4"]), numbers.choice([None, 2, 4, 8])
    job = Job(["segment", name, "--points", "marks.csv", "--image-spacing", "1,1,1", "--max-steps", "8"])
    job.makes.append(lambda folder, rng: inputs.stack(folder, name, rng, shape, dtype, objects, wide))
    job.arguments += some(numbers, 0.3, "--crop", crop(numbers, shape))
    if objects > 1:
        job.arguments += some(numbers, 0.5, "--fill-gaps", numbers.choice(["auto", "3", "8"]))
    job.arguments += some(numbers, 0.2, "--image", numbers.choice(["level", "wall", "edge", "none"]))
    job.arguments += some(numbers, 0.3, "--start", "flood") + some(numbers, 0.15, "--smoothing", "heat")
    job.arguments += some(numbers, 0.2, "--sigma", f"{numbers.uniform(0.5, 6):.2f}")
    job.arguments += some(numbers, 0.15, "--cross-validate") + some(numbers, 0.1, "--no-caps")
    job.arguments += numbers.choice(OUTPUTS)
    return Job(
        job.arguments + some(numbers, 0.3, "--mesh", "out.ply") + some(numbers, 0.3, "--picture", "out.png"), job.makes
    )


def measure(numbers):
    job = Job(["measure", "mesh.obj", *some(numbers, 0.7, "--points", "cloud.csv")], is_limited=False)
    triangles, points = within(numbers, 100, 100_000), int(within(numbers, 10, 100_000))
    job.makes.append(lambda folder, rng: inputs.mesh(folder / "mesh.obj", rng, triangles))
    job.makes.append(lambda folder, rng: inputs.cloud(folder / "cloud.csv", rng, points))
    return job


def info(numbers):
    name, shape = volume_name(numbers, "stack"), volume_shape(numbers, 1e5, 1.5e7)
    job = Job(["info", name], is_limited=False)
    job.makes.append(lambda folder, rng: inputs.stack(folder, name, rng, shape, "u2", 1, 4))
    return job


# How often each command is tried.
COMMANDS = {distance: 35, segment: 30, middle: 15, reconstruct: 15, measure: 2, info: 3}


def random_job(numbers):
    """A job of any command, with bricks and threads at random."""
    command = numbers.choices(list(COMMANDS), COMMANDS.values())[0]
    job = command(numbers)
    if job.is_limited:
        job.arguments += ["--threads", str(numbers.randint(1, 3))]
        job.arguments += some(numbers, 0.6, "--brick", str(numbers.choice([16, 32, 48, 64, 96, 128])))
    return job
