"""The cost of labels, and other programs that keep the nearest source: scripts/bench_labels."""
