"""Several pictures of one part adjusted together (bundle adjustment): its features in space, and the sensors' places."""
