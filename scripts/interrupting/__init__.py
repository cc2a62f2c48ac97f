"""scripts/try_signals: runs of the program that a signal ends, and what they leave behind."""
