"""Boards beside the part: how images of their points depend on places, and what a picture tells by them."""
