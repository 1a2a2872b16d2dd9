"""Do prediction, render and measurement agree, scene by scene and estimator by estimator? ``make agreement``."""
