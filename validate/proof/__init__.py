"""Proofs of what the batch job promises, by doing it: ``python -m validate.proof --help``."""
