"""The commands of ``ice``, one module each."""
