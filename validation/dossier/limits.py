"""What the program does not model, in one place: of the page, of the documentation, and of nothing else."""

from __future__ import annotations

LIMITS = (
    ("Pictures", "All are simulated. No camera took part; nothing is said of any real part.",
     "photograph a calibrated part repeatedly and give the pictures to `ice validate SCENE --photos DIR`"),
    ("The part", "Its form is the model's: chamfers, burrs, warp and roughness that the file lacks move edges.",
     "give what is known of them as `uncertainty.part_shift`, or measure a calibrated part"),
    ("Surfaces", "A diffuse part and one specular lobe (Torrance and Sparrow), textures as stated: no translucency, no "
     "anisotropy, no stains.", "state how exactly the reflectance is known (`uncertainty.reflectance`)"),
    ("Light", "The lamps of the scene, and light between its surfaces. Light of the room and of things that the scene "
     "does not have is missing.", "shield the station, or add them to the scene"),
    ("Lens", "Distortion, fall of brightness and blur over the field are those that the scene states; what it does not "
     "state is missing, and the uncertainty of the distortion is that of its model's numbers.",
     "calibrate with the board where the part is (`ice calibrate-camera`)"),
    ("Noise", "EMVA 1288's linear model: dark noise, shot noise, fixed pattern, rounding, independent from "
     "pixel to pixel but for what rows and columns share as stated (`row_sigma`, `column_sigma`), and until a colour "
     "mosaic is filled in.",
     "photographs whose noise is correlated get the status `correlated`; estimate the noise of your own camera"),
    ("Motion and time", "A part that moves is sheared by a rolling shutter as the scene states, and not smeared; "
     "nothing drifts between pictures but what the scene states.",
     "expose shortly; state drifts as uncertainties of distance, pose and temperature"),
    ("The budget's model", "A tilt of the part is not followed into its brightness, errors of place not into the "
     "locators' bias, a turn of a circle about its centre is of first order.",
     "`ice budget SCENE --stations N` tells of plain scenes what that leaves out"),
    ("Simulated stations", "They draw what the scene states, with the distributions that it states. What is stated too "
     "small is too small in them, too.", "state each input from its own certificate or study"),
)  # fmt: skip
"""What about, what is not modelled, and what a laboratory does about it."""
