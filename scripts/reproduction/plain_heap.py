"""A binary heap of places by their keys, from index 1 on; a lowered key is a second entry, the first one is passed over."""

from numba import njit


@njit(cache=True)
def put(heap, keys, key, place):
    heap.append(place)
    keys.append(key)
    n = len(heap) - 1
    while n > 1 and key < keys[n // 2]:
        heap[n], keys[n] = heap[n // 2], keys[n // 2]
        n //= 2
    heap[n], keys[n] = place, key


@njit(cache=True)
def pop(heap, keys, shape):
    """The smallest key and its place."""
    smallest, top = keys[1], heap[1]
    place, key = heap.pop(), keys.pop()
    length = len(heap)
    if length > 1:
        n = 1
        while 2 * n < length:
            child = 2 * n
            if child + 1 < length and keys[child + 1] < keys[child]:
                child += 1
            if keys[child] >= key:
                break
            heap[n], keys[n] = heap[child], keys[child]
            n = child
        heap[n], keys[n] = place, key
    i, rest = divmod(top, shape[1] * shape[2])
    j, k = divmod(rest, shape[2])
    return smallest, i, j, k
