"""Mutants that no test can kill, with the reason of each: they do what the code does."""

EQUIVALENT: dict[str, str] = {}
