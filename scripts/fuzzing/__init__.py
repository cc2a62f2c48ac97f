"""scripts/fuzz_readers: damaged files for every reader, for as long as one likes."""
