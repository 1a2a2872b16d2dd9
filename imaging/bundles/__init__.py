"""Several pictures of one part adjusted together (bundle adjustment): its features in space, and where the sensors are."""
