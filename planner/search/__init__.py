"""Where to put sensor and light: viewing space, searches, constraints."""
