"""Several pictures of one part adjusted together (bundle adjustment): its features and the sensors in space."""
