"""The uncertainty budget of a scene: which inputs it has, what each does to the measured values, and their sum."""
