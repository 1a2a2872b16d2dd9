"""What holds where nobody says otherwise."""

DEFAULT_SEED = 1995  # root of all random numbers of a run or a command: the paper's year
