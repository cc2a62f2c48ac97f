"""scripts/try_limits: random jobs with random tight memory limits, and what they really took."""
