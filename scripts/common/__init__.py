"""What scripts/reproduce and scripts/bench_peers share: the program, inputs, the pages that are written."""
