"""Mutants that no test can kill, with the reason of each: they do what the code does."""

# by file and mutated line
EQUIVALENT: dict[str, str] = {
    "measure/goodness.py: each = np.where(used, freedom, 2.0)": "parts without freedom are left out two lines below",
    "measure/features/layout.py: middle = self.ends.reshape(- 2, 2).mean(0)": "numpy takes any negative size as open",
    "planner/imaging/rays.py: _CHUNK = 400001  # ray-triangle pairs at a time": "how many at a time changes no result",
    "planner/imaging/appearance.py: if scene.noise.gain == -1 and not sides.max(initial=0.0) > "
    "sensor.headroom(scene.noise):": "a shorter way to the same numbers is not taken",
    'render/build.py: "near_clip": 1e-3 / camera.distance,': "nothing stands so near to the sensor",
}
