"""scripts/compare_segmentation: objects from border points by this program and by others, where the truth is known."""
