"""The model of a picture: where points of the scene land in the image, how bright they are, how their noise varies.

What is expected of lines, corners, circles and contours, and how errors of edge points become errors of measurands,
stands here too: planner, renderer and measurement ask one model.
"""

import ice_vision

ice_vision.check(__file__, "scenes")
