"""Variance models: how precisely the features of a picture can be located, without an image."""
