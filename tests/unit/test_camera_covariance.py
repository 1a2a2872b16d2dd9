"""A camera calibration's covariance: what is one, and what files say of it."""

import json

import numpy as np
import pytest

from scenes import InvalidInput
from scenes.cameras.covariance import ORDER, Covariance, of_document

SD = {"fx": 2.0, "cx": 0.5, "k1": 1e-3}


def matrix(change=None, *, fx_cx=0.6, fx_k1=-0.3, cx_k1=0.4) -> list[list[float]]:
    """Of three parameters of very different sizes, so correlated; ``change`` is added to one element."""
    unit = np.array([[1, fx_cx, fx_k1], [fx_cx, 1, cx_k1], [fx_k1, cx_k1, 1]])
    whole = unit * np.outer(list(SD.values()), list(SD.values()))
    if change:
        row, column, by = change
        whole[row, column] += by
    return whole.tolist()


def made(rows, names=tuple(SD)) -> Covariance:
    return Covariance.model_validate({"names": names, "matrix": rows})


def test_standard_deviations_and_correlation():
    found = made(matrix())
    assert found.sd == pytest.approx(list(SD.values()))
    np.testing.assert_allclose(found.correlation, [[1, 0.6, -0.3], [0.6, 1, 0.4], [-0.3, 0.4, 1]], atol=1e-12)
    known = made([[4.0, 0.0], [0.0, 0.0]], ("fx", "k1"))  # the second is known
    assert known.correlation.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize("place", [(0, 1), (2, 0), (1, 2)])
def test_it_is_symmetric_within_rounding(place):
    """A billionth of both standard deviations' product, whichever side is larger."""
    size = list(SD.values())[place[0]] * list(SD.values())[place[1]]
    for by in (0.5e-9, -0.5e-9):
        made(matrix((*place, by * size)))
    for by in (2e-9, -2e-9, 0.5):
        with pytest.raises(ValueError, match="must be symmetric with no negative diagonal"):
            made(matrix((*place, by * size)))


@pytest.mark.parametrize("index", [0, 1, 2])
def test_no_variance_is_negative(index):
    rows = np.diag(np.square(list(SD.values())))
    rows[index, index] *= -1e-6
    with pytest.raises(ValueError, match="must be symmetric with no negative diagonal"):
        made(rows.tolist())


def test_it_is_positive_semidefinite_within_rounding():
    """Three numbers of which each is another's: correlations of 1; and such as no three numbers have."""
    made(matrix(fx_cx=1.0, fx_k1=1.0, cx_k1=1.0))
    made(matrix(fx_cx=1 + 0.5e-9, fx_k1=1.0, cx_k1=1.0))
    for wrong in ({"fx_cx": 1.0, "fx_k1": 1.0, "cx_k1": 1 - 1e-6}, {"fx_cx": -0.6, "fx_k1": 0.8, "cx_k1": 0.8}):
        with pytest.raises(ValueError, match="must be positive semidefinite"):
            made(matrix(**wrong))
    with pytest.raises(ValueError, match="must be positive semidefinite"):
        made([[4.0, 2.0 + 1e-8], [2.0 + 1e-8, 1.0]], ("fx", "fy"))


@pytest.mark.parametrize(
    ("names", "rows", "match"),
    [
        (("fx", "fx"), [[1.0, 0.0], [0.0, 1.0]], "must be different parameters, got"),
        ((), [], "must be different parameters, got"),
        (("fx", "fy"), [[1.0, 0.0]], r"must be 2 rows of 2 numbers, got \[2\]"),
        (("fx", "fy"), [[1.0, 0.0], [1.0]], r"must be 2 rows of 2 numbers, got \[2, 1\]"),
        (("fx",), [[1.0, 0.0]], r"must be 1 rows of 1 numbers, got \[2\]"),
    ],
)
def test_names_and_rows_are_as_many(names, rows, match):
    with pytest.raises(ValueError, match=match):
        made(rows, names)


def test_opencv_s_standard_deviations_are_uncorrelated(tmp_path):
    """In its own order, as rows of one or as numbers; those of 0 are known, and what follows k3 must be."""
    sd = [2.0, 3.0, 0.0, 0.7, 0.01, 0.02, 0.0, 0.0, 0.05]
    (tmp_path / "a.json").write_text(json.dumps({"stdDeviationsIntrinsics": [[v] for v in [*sd, 0, 0, 0]]}))
    (tmp_path / "a.toml").write_text(f"stdDeviationsIntrinsics = {sd}")
    for name in ("a.json", "a.toml"):
        found = of_document(name, tmp_path)
        assert found.names == ("fx", "fy", "cy", "k1", "k2", "k3")
        assert found.sd == pytest.approx([2.0, 3.0, 0.7, 0.01, 0.02, 0.05])
        assert (found.correlation == np.eye(6)).all()
    assert ORDER == ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ([*[0.1] * 9, 0.0, 0.2], r"must be 0 after k3, got \[0.0, 0.2\]"),
        ([], "must be a list of numbers, got"),
        ([True, 1.0], "must be a list of numbers, got"),
        ([[1.0, 2.0]], "must be a list of numbers, got"),
        (["1"], "must be a list of numbers, got"),
        (3.0, "must be a list of numbers, got"),
    ],
)
def test_other_standard_deviations_are_refused(tmp_path, given, match):
    with pytest.raises(InvalidInput, match=match):
        of_document({"stdDeviationsIntrinsics": given}, tmp_path)


def test_a_file_that_is_none_is_named(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps({"names": ["fx"], "matrix": [[-4.0]]}))
    with pytest.raises(InvalidInput, match=r"a\.json: .*must be symmetric with no negative diagonal"):
        of_document("a.json", tmp_path)
    assert of_document({"names": ["fx"], "matrix": [[4.0]]}, tmp_path) == {"names": ["fx"], "matrix": [[4.0]]}
