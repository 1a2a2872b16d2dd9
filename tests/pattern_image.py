"""Pictures of tags and chessboards: cells under a projective map, exactly placed, blurred and averaged over pixels."""

import cv2
import numpy as np

_FINE = 5  # subpixels a side


def pattern_image(cells, corners, shape, blur=0.8, dark=30.0, bright=200.0):
    """Grey levels (height, width) of a pattern of cells (rows, columns), 0 or 1, on a bright ground.

    Parameters
    ----------
    cells : array_like, shape (rows, columns)
    corners : array_like, shape (4, 2)
        Of the whole pattern in the image, px: its upper left, upper right, lower right and lower left.
    shape : tuple of int
    blur : float
        Standard deviation of the lens blur, px.
    """
    cells = np.asarray(cells, float)
    rows, columns = cells.shape
    around = np.pad(cells, 1, constant_values=1.0)
    large = np.kron(around, np.ones((20, 20)))
    source = np.array([[1, 1], [columns + 1, 1], [columns + 1, rows + 1], [1, rows + 1]]) * 20 - 0.5
    target = np.asarray(corners) * _FINE + (_FINE - 1) / 2
    to_image = cv2.getPerspectiveTransform(source.astype(np.float32), target.astype(np.float32))
    size = shape[1] * _FINE, shape[0] * _FINE
    fine = cv2.warpPerspective(large, to_image, size, flags=cv2.INTER_LINEAR, borderValue=1.0)
    fine = cv2.GaussianBlur(fine, (0, 0), blur * _FINE)
    return dark + (bright - dark) * fine.reshape(shape[0], _FINE, shape[1], _FINE).mean((1, 3))


def tag_cells(family, number):
    """Cells of a tag with its black border, of OpenCV's dictionary DICT_<family>."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}"))
    return cv2.aruco.generateImageMarker(dictionary, number, dictionary.markerSize + 2) / 255


def chessboard_cells(columns, rows):
    """Squares (rows, columns) of a chessboard, the first one black."""
    return np.add.outer(np.arange(rows), np.arange(columns)) % 2
