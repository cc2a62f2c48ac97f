"""The runs that are compared: arguments of each, with {made} for the folder of inputs and {out} for that of outputs."""

METHODS = ("fsm", "vdt", "fmm", "dp")


def distances():
    """Every method by every schedule, start, layout and output."""
    clouds = "distance {made}/cloud-a.csv {made}/cloud-b.csv {made}/cloud-c.csv --spacing 0.06 -o {out}/out.zarr"
    for method in METHODS:
        for schedule in ("front", "sweep"):
            yield f"{clouds} --method {method} --schedule {schedule}"
            yield f"{clouds} --method {method} --schedule {schedule} --labels --closest-point"
    for method in ("vdt", "dp"):
        yield f"{clouds} --method {method} --neighbours 26 --labels"
    yield f"{clouds} --method vdt --labels --brick 16 --threads 1"
    yield f"{clouds} --method fsm --labels --brick 64"
    yield f"{clouds} --method vdt --init contiguous"
    yield f"{clouds} --method fsm --init grid"
    yield f"{clouds} --method dp --max-distance 0.5 --labels"
    yield f"{clouds} --method fmm --precision f64"
    yield f"{clouds} --method vdt --precision f16 --closest-point"
    yield f"{clouds} --method vdt --ranks 3 --labels"
    yield "distance {made}/cloud-a.csv {made}/cloud-b.csv --spacing 0.012 -o {out}/out.zarr --labels --closest-point --memory 352MiB"
    for method in METHODS:
        yield f"distance {{made}}/ball.obj --spacing 0.05 --padding 5 -o {{out}}/out.zarr --signed --method {method}"
    yield "distance {made}/ball.obj {made}/cloud-b.csv --spacing 0.05 -o {out}/out.zarr --labels --closest-point"
    yield "distance {made}/labels.tif -o {out}/out.zarr --labels"


def middles():
    """Two and four labels, by each way to tell them."""
    for method in METHODS:
        yield f"middle {{made}}/cloud-a.csv {{made}}/cloud-b.csv --spacing 0.06 -o {{out}}/out.zarr --method {method}"
    four = "middle {made}/cloud-a.csv {made}/cloud-b.csv {made}/cloud-c.csv {made}/ball.obj --spacing 0.06 -o {out}/out.zarr"
    yield four
    yield f"{four} --labels tracked --threads 1"
    yield "middle {made}/cloud-a.csv {made}/cloud-b.csv --spacing 0.06 -o none --mesh {out}/between.stl --surface labels"
    yield "middle {made}/labels.tif -o {out}/out.zarr"


def reconstructions():
    """A sphere and a torus, plain and by the papers' way."""
    yield "reconstruct {made}/sphere.csv -o {out}/out.zarr"
    yield "reconstruct {made}/sphere.csv -o {out}/out.zarr --brick 16 --threads 1"
    yield "reconstruct {made}/torus.csv -o {out}/out.zarr"
    yield "reconstruct {made}/torus.csv -o none --mesh {out}/torus.obj --method vdt"


def segmentations():
    """A made stack with two objects, by several settings."""
    plain = "segment {made}/stack.tif --points {made}/marks.csv -o {out}/out.zarr"
    yield plain
    yield f"{plain} --brick 16 --threads 1"
    yield f"{plain} --start flood"
    yield f"{plain} --fill-gaps auto"
    yield f"{plain} --edge plain"
    yield f"{plain} --memory 160MiB"


def all_settings():
    """All of them, in the order in which they run."""
    return [*distances(), *middles(), *reconstructions(), *segmentations()]
