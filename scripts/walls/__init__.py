"""Walls between labels of a volume, beside another program's: scripts/bench_walls."""
