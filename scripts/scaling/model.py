"""The model: what a rank computes, what it sends, and for how long it waits.

    T = slowest rank's bricks * seconds a brick / cores                        solving and writing
      + rounds * messages a round * (latency * binary digits of the ranks)     agreeing
      + bytes of faces / bandwidth                                             between neighbours
      + bytes of the output / bandwidth of the file system

Bricks are shared out in runs of the grid's order, so a rank has a slab: as long as it is thicker than a brick it sends two faces of
the grid's width, thinner ones send as much to more ranks. The front passes through slabs, so not all are busy at all times: the
slowest takes `unevenness` times the mean. It is measured, by what ranks wait where each has a core, else by their bricks, and kept
beyond.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Machine:
    """A rank's machine and the network between them."""

    cores: int
    latency: float
    bandwidth: float
    disk: float


@dataclass(frozen=True)
class Measured:
    """What runs on one and two ranks of one core each have told."""

    brick_edge: int
    seconds_per_visit: float
    visits_per_brick: float
    seconds_per_voxel_written: float
    bytes_per_voxel_written: float
    rounds_per_edge: float
    messages_per_round: float
    bytes_per_face_voxel: float
    unevenness: dict


def unevenness(measured, ranks):
    """Of the measured numbers of ranks, the nearest below, and the largest beyond."""
    return measured.unevenness[max(n for n in measured.unevenness if n <= ranks)]


def seconds(measured, machine, edge, ranks):
    """Seconds of each part of a run over a cube of `edge` voxels."""
    bricks = math.ceil(edge / measured.brick_edge) ** 3
    own = math.ceil(bricks / ranks) * unevenness(measured, ranks)
    solving = own * measured.visits_per_brick * measured.seconds_per_visit / machine.cores
    writing = edge**3 / ranks * unevenness(measured, ranks) * measured.seconds_per_voxel_written / machine.cores
    digits = math.ceil(math.log2(ranks)) if ranks > 1 else 0
    agreeing = (
        measured.rounds_per_edge * edge / measured.brick_edge * measured.messages_per_round * digits * machine.latency
    )
    faces = 0 if ranks == 1 else 2 * edge**2 * measured.bytes_per_face_voxel / machine.bandwidth
    stored = edge**3 * measured.bytes_per_voxel_written / machine.disk
    return {"solving": solving, "writing": max(writing, stored), "agreeing": agreeing, "faces": faces}


def total(measured, machine, edge, ranks):
    return sum(seconds(measured, machine, edge, ranks).values())
