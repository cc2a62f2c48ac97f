"""Surfaces from point clouds beside those of another program."""
