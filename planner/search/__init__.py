"""Where to put sensor and light: viewing space, what is minimised, searches."""
