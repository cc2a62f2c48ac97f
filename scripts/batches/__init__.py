"""scripts/try_batch: a batch of many small items, and whether it keeps what it promises."""
