"""Tables of brightness on plane faces, against the planner's reflectance at points between their nodes."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.signal import convolve2d

import scenes
from imaging.models.texture import field_covariance
from render import texture
from render.build import textured
from scenes import Material, Picture, Pose
from scenes.materials.brdf import Index

LOBE = frozenset({"specular_lobe"})
SETTINGS = [((30, 135), (15, 315)), ((45, 225), (45, 105)), ((75, 20), (70, 80))]


def glossy(roughness, **values):
    material = Material(
        specular_fraction=0.6, diffuse_reflectance=0.5, refractive_index=1.1, extinction=6.9, roughness=roughness
    )
    return scenes.load("glossy_metal").model_copy(update={"material": material, **values})


def made(scene, sensor, light, active=LOBE):
    found = textured(Picture.of(scene, sensor, light), active)
    return None if found is None else found[0]


def misses(scene, sensor, light, face, values, rng):
    """Errors of linear interpolation at random points of a face, of the table's largest value."""
    weights = rng.dirichlet([1, 1, 1], (len(face.triangles), 3000))
    points = np.einsum("tsn,tnx->tsx", weights, face.triangles).reshape(-1, 3)
    places = np.einsum("tsn,tnx->tsx", weights, face.places).reshape(-1, 2)
    across = np.cross(*np.diff(face.triangles[0], axis=0))
    normal = np.broadcast_to(across / np.linalg.norm(across), points.shape)
    away = [scene.position(role, Pose(*pose)) - points for role, pose in (("light", light), ("sensor", sensor))]
    beams = [part / np.linalg.norm(part, axis=1, keepdims=True) for part in away]
    index = (Index(scene.material.refractive_index, scene.material.extinction),)
    exact = scene.material.reflected(index, normal, *beams) / (normal * beams[0]).sum(1)
    size = np.array(values.shape[::-1]) - 1
    return (map_coordinates(values, (places * size).T[::-1], order=1) - exact) / exact.max()


@pytest.mark.parametrize(("sensor", "light"), SETTINGS)
@pytest.mark.parametrize("roughness", [0.03, 0.1, 0.3, 1.0])
def test_interpolation_is_within_the_bound(rng, roughness, sensor, light):
    """5e-5 anywhere and 1e-5 in the mean."""
    scene = glossy(roughness)
    for face in made(scene, sensor, light)[:-1]:
        error = np.abs(misses(scene, sensor, light, face, face.values, rng))
        assert error.max() < 5e-5
        assert error.mean() < 1e-5  # margin: the claim: it decides the number of nodes


@pytest.mark.parametrize("roughness", [0.03, 0.1, 0.3])
def test_fewer_nodes_would_not_do(rng, roughness):
    """Negative control: every eighth node under a mirrored light, 64 times the error."""
    scene, poses = glossy(roughness), ((30, 135), (30, 315))
    face = made(scene, *poses)[0]
    # margin: twice the claim at least
    assert np.abs(misses(scene, *poses, face, face.values[::8, ::8], rng)).max() > 1e-4
    assert np.abs(misses(scene, *poses, face, np.roll(face.values, 1, 1), rng)).max() > 1e-4


@pytest.mark.parametrize("seed", range(3))
def test_creases_and_grazing_angles_are_within_the_bound(seed):
    """Random poses down to 2 degrees over the table, all roughnesses: no more than 5e-5, and nearly always a table."""
    rng, refused = np.random.default_rng(seed), 0
    for _ in range(20):
        scene = glossy(10 ** rng.uniform(-1.3, 0.2))
        poses = [(rng.uniform(0, 88), rng.uniform(0, 360)) for _ in range(2)]
        faces = made(scene, *poses)
        refused += faces is None
        for face in (faces or ())[:-1]:
            assert np.abs(misses(scene, *poses, face, face.values, rng)).max() < 5e-5
    assert refused <= 1


def test_a_lobe_is_not_lost_between_the_first_nodes(monkeypatch):
    """Nodes are at least as close as the facets' slopes ask for, whatever the values say at the first ones."""
    monkeypatch.setattr(texture, "shade", lambda surface, normal, points, material: np.ones(points.shape[:-1]))
    poses = (30, 135), (30, 315)
    assert len(made(glossy(0.3), *poses)[0].values) == 17
    assert len(made(glossy(0.005), *poses)[0].values) > 17
    monkeypatch.setattr(texture, "_LOBE", 1e9)
    assert len(made(glossy(0.005), *poses)[0].values) == 17


def test_dark_faces_and_the_others_are_the_whole_surface():
    scene = glossy(0.3)
    *lit, rest = made(scene, (30, 135), (15, 315))
    assert [len(face.triangles) for face in lit] == [2]  # the light stands behind both sides that the sensor sees
    assert (rest.values == 0).all()
    assert len(rest.triangles) + 2 == len(scene.solid.triangles)
    both = np.sort(np.concatenate([part.triangles for part in (*lit, rest)]).reshape(-1, 9), axis=0)
    assert (both == np.sort(scene.solid.triangles.reshape(-1, 9), axis=0)).all()


def test_obstacles_have_tables_of_their_own_where_they_cast_shadows():
    scene = scenes.load("grey_floor")
    found = textured(Picture.of(scene, (30, 15), (40, 200)), LOBE | {"cast_shadow"})
    assert len(found) == 1 + len(scene.obstacles) == 2
    assert len(textured(Picture.of(scene, (30, 15), (40, 200)), LOBE)) == 1


def test_no_table_where_brightness_has_no_such_form():
    """Light of some size, an aperture, light from other surfaces, and a lobe too narrow for the most nodes."""
    scene = glossy(0.3)
    large = scene.model_copy(update={"light": scene.light.model_copy(update={"radius": 1.0})})
    poses = (30, 135), (15, 315)
    assert made(scene, *poses) is not None
    assert made(large, *poses) is not None
    assert made(large, *poses, LOBE | {"light_size"}) is None
    assert made(scene, *poses, LOBE | {"depth_of_field"}) is None
    assert made(scene, *poses, LOBE | {"interreflection"}) is None
    assert made(glossy(1e-6), *poses) is None


def test_sums_over_a_filtered_field_vary_as_on_an_endless_sheet(rng):
    """White noise through a filter without symmetry, weighted at nodes near both ends: no tail of it is cut off."""
    kernel = rng.normal(size=(5, 7))
    field = SimpleNamespace(margin=(2, 3), filtered=lambda each: convolve2d(each, kernel, mode="same"))
    sheet = SimpleNamespace(field=field, values=np.zeros((12, 14)))
    weights = np.zeros((2, 12, 14))
    parts = []
    for k, (rows, columns) in enumerate((([1, 0, 6], [2, 0, 7]), ([11, 9, 5], [13, 10, 6]))):
        weights[k, rows, columns] = own = rng.normal(size=3)
        parts.append((slice(k, k + 1), np.stack([columns, rows], 1).astype(float), own[None]))
    endless = [convolve2d(np.pad(each, 8), kernel, mode="same").ravel() for each in weights]
    found = field_covariance(sheet, parts, 2)
    assert found == pytest.approx(np.array([[a @ b for b in endless] for a in endless]), abs=1e-12)
