"""A user's own kinds, one file each, that touch no file of the packages (`tests/unit/test_outside.py`)."""
