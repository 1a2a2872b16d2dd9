"""The model of a picture: where points of the scene land in the image, how bright they are, how their noise varies.

What is expected of lines, corners, circles and contours, and how errors of edge points become errors of measurands,
stands here too: planner, renderer and measurement ask one model. Lengths in space are in the scene's unit, in the image
px with (0, 0) the centre of the first pixel, x to the right, y down.
"""

import ice_vision

ice_vision.check(__file__, "scenes")
