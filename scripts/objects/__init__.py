"""Timing of many small objects: made stack and marks, two builds of the program in turn."""
