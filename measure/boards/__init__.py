"""Chessboards: their corners, and the camera that saw them."""
