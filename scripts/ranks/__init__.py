"""Random jobs on several ranks."""
