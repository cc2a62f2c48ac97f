"""scripts/try_cases: runs the program on folders of inputs and says what came of each run."""
