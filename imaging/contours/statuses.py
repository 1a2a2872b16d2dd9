"""What can be said of a limb. Only `OK` comes with points."""

OK = "ok"
INSIDE = "inside"  # the eye stands in the surface, or so that no line through it touches
TANGENT = "tangent"  # the eye stands on the surface to rounding
DEGENERATE = "degenerate"  # planes, lines or points: nothing curved
NONE = "none"  # every line through the eye meets the surface, or none does
CONCAVE = "concave"  # lines touch from within the material alone
BEHIND = "behind"  # all that is touched lies behind the camera
