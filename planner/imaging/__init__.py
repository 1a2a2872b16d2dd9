"""The model of a picture: where points of the scene land in the image, how bright they are, how their noise varies."""
