"""How a made stack becomes a picture: blur, photons, a smooth random field for texture and fading."""

import numpy as np
from scipy import ndimage


def blurred(signal, sigma):
    """`sigma` in voxels, one number or z, y, x."""
    return ndimage.gaussian_filter(signal.astype(np.float64), sigma)


def photons(signal, rng, gain=1.0, offset=0.0):
    """Poisson noise of `signal / gain` photons, each counted as `gain`, above an offset; u16."""
    counts = rng.poisson(np.maximum(signal, 0) / gain)
    return np.clip(np.round(offset + gain * counts), 0, 65535).astype(np.uint16)


def smooth_noise(shape, sigma, rng):
    """A random field with mean 0 and deviation 1 that changes over `sigma` voxels (one number or z, y, x)."""
    field = ndimage.gaussian_filter(rng.normal(size=shape), sigma, mode="wrap")
    return (field - field.mean()) / field.std()
