"""Surfaces from noisy clouds and clouds with holes, beside the true ones."""
