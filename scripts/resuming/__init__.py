"""scripts/try_resume: runs that are ended in the middle and gone on with."""
