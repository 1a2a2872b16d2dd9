"""Lines, corners, circles: what is found in an image, with its covariance."""
