"""Touches memory and frees it again, so that the next program finds it in the machine.

A virtual machine fetches memory from its host when a page is first touched and gives it back soon after it is freed; that
costs 1 to 2 s per GiB, more than many of the programs take, and would hit the one that happens to come after a pause.
"""

import mmap

BYTES_PER_VOXEL = 16
MOST = 4 << 30


def warm(voxels):
    """As much memory as most of the programs take for so many voxels."""
    count = min(BYTES_PER_VOXEL * voxels, MOST)
    with mmap.mmap(-1, count, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) as memory:
        if hasattr(mmap, "MADV_HUGEPAGE"):
            memory.madvise(mmap.MADV_HUGEPAGE)
        for place in range(0, count, mmap.PAGESIZE):
            memory[place] = 1
