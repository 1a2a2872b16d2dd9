"""How lines are found in an image: one file an estimator, known by name in the registry."""
