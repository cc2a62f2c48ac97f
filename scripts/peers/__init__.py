"""Other programs and this one on the same inputs: scripts/bench_peers."""
