"""Proofs of what the batch job promises, by doing it: ``python -m tests.proofs --help``."""
