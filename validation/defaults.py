"""Default values that several commands share."""

DEFAULT_SEED = 1995  # root of all random numbers of a run or a command: the paper's year
