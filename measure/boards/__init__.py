"""Boards: chessboards, dots and markers, and the camera that saw them."""
