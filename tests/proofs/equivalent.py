"""Mutants that no test can kill, with the reason of each: they do what the code does."""

# by file and mutated line
EQUIVALENT: dict[str, str] = {}
