"""The search of `ice design`: bounds that hold, the winner of a brute force, optics against closed forms."""

from __future__ import annotations

import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import scenes
from imaging.geometry.projection import project
from planner.designing import ahead, alternatives, search
from planner.designing.bounds import NOISE, REASONS, pairs
from planner.designing.close import Close, look
from planner.designing.dominance import of_light, of_sensor, undominated
from planner.designing.evaluation import OWN_LIGHT, Problem, Rated, limit_ratio, rate, rate_light, views
from planner.designing.optics import ROLLING, TIME, Focused, blur_um, chosen, focused
from planner.designing.outcome import Design, Offer, Tally, to_three
from planner.designing.search import design
from planner.designing.stations import carried, station
from planner.designing.usable import COLOUR, CONTRADICTORY, INCOMPLETE, LARGE, PRICELESS, usable
from planner.designing.wishes import Wishes, allowed
from planner.uncertainty.risks import Limits, global_risks
from scenes import InvalidInput, Jitter, Uncertainty, catalogue
from scenes.cameras.covariance import Covariance
from scenes.catalogue import Catalogue, ListedLens, ListedLight, ListedSensor
from tests.benchmarks.design import brute_force, synthetic
from validation import designed


@cache
def _problem(k: float = 4.0, name: str = "calibrated_rig", **wishes: float) -> Problem:
    return Problem.of(scenes.load(name), Wishes(k=k, lens_blur_um=2.0, **wishes))


@pytest.mark.parametrize(("seed", "k"), [(3, 4.0), (4, 12.0)])
def test_the_winner_is_that_of_all_combinations(seed: int, k: float) -> None:
    found = synthetic(seed, 6, 14, 4)
    by_search = design(_problem(k), found, beside=0)
    by_all = brute_force(_problem(k), found)
    assert by_search.reached == (by_all is not None)
    if by_all is not None:
        assert by_search.best.cost == pytest.approx(by_all[0], rel=1e-12)
        assert by_search.best.rated.names == by_all[1]
        assert by_search.searched.rated < 6 * 14 * 4 / 4


def test_of_equal_cost_the_least_ratio_wins() -> None:
    """Without prices all lenses and lights before one camera cost the same; each pair has the first light that does."""
    priced, problem = synthetic(11, 1, 40, 3), _problem(1.5)
    glass = next(each for each in priced.lenses if each.focal_length_mm == 25.0)
    lenses = [glass.model_copy(update={"name": f"{focal}", "focal_length_mm": focal, "image_circle_mm": 40.0})
              for focal in (12.0, 16.0, 25.0)]  # fmt: skip
    given = priced.model_copy(update={"lenses": tuple(lenses), "lights": priced.lights[::2]})
    tables = {name: tuple(each.model_copy(update={"price": None}) for each in getattr(given, name))
              for name in ("sensors", "lenses", "lights")}  # fmt: skip
    found = design(problem, given.model_copy(update=tables), beside=0)
    each_pair = [_first_that_does(problem, tables["sensors"][0], lens, tables["lights"]) for lens in tables["lenses"]]
    ratios = sorted(ratio for ratio in each_pair if ratio is not None)
    assert len(ratios) == 3
    assert to_three(found.best.ratio) == to_three(ratios[0]) < to_three(ratios[1])


def _first_that_does(
    problem: Problem, camera: ListedSensor, lens: ListedLens, lights: tuple[ListedLight, ...]
) -> float | None:
    for light in lights:
        rated = rate(problem, camera, lens, light)
        if isinstance(rated, Rated) and rated.ratio <= 1 and (close := look(problem, rated)).ratio <= 1:
            return close.ratio
    return None


def test_straight_edges_alone_promise_no_less_than_all_features() -> None:
    """Of a bracket's requirements three are of edges alone: these are told as with the circles, the others nothing."""
    problem, parts = _problem(4.0, "bracket_station"), catalogue.load("sample")
    camera = next(each for each in parts.sensors if "C-158m" in each.name)
    lens = next(each for each in parts.lenses if "FA2524" in each.name)
    rough, whole = (views(problem, camera, lens, of_rims=of_rims) for of_rims in (False, True))
    straight = np.array([each.name in ("step", "across", "square") for each in problem.scene.quantities])
    edges = {each.aspect.pose: each.systematic for each in rough}
    assert len(edges) == len(whole) > 1
    for view in whole:
        assert edges[view.aspect.pose][straight] == pytest.approx(view.systematic[straight], rel=1e-12)
        assert (edges[view.aspect.pose][~straight] == 0).all()
        assert (view.systematic > 0).all()


def test_bounds_leave_out_no_pair_that_may_do() -> None:
    """Least noise of a pair is below that of every light; what bounds say is impossible has no view, and back."""
    exact = {"uncertainty": Uncertainty(fixed_pattern=False), "uncertain": (), "jitter": Jitter()}
    scene = scenes.load("calibrated_rig").model_copy(update=exact)
    problem, found = Problem.of(scene, Wishes(lens_blur_um=2.0)), synthetic(7, 8, 14, 3)
    table = pairs(problem, found.sensors, found.lenses)
    nearest = []
    for i, camera in enumerate(found.sensors):
        for j, lens in enumerate(found.lenses):
            seen = views(problem, camera, lens)
            stage = REASONS[table.reason[i, j] - 1] if table.reason[i, j] else None
            assert isinstance(seen, str) == (stage not in (None, NOISE)), (camera, lens, seen, stage)
            for light in () if isinstance(seen, str) else found.lights:
                rated = rate_light(problem, camera, lens, light, seen)
                if isinstance(rated, Rated):
                    nearest.append(table.least[i, j] / rated.ratio)
    assert max(nearest) <= 1
    assert max(nearest) > 0.1  # a bound of nothing would hold, too


def test_the_distance_is_the_least_that_shows_all() -> None:
    """At the distance that a pair is given, the farthest point is imaged where the margin begins."""
    problem, found = _problem(name="bracket_mm"), synthetic(2, 6, 12, 1)
    checked = 0
    for camera in found.sensors:
        for lens in found.lenses:
            aspect = problem.aspects[0]
            at = focused(camera, lens, aspect, problem.wishes)
            if isinstance(at, str) or lens.is_telecentric:
                continue
            settings = chosen(camera, lens, OWN_LIGHT, aspect, problem.wishes, 1.0, 2.0, 300.0, at)
            if isinstance(settings, str):
                continue
            scene = station(problem.scene, settings)
            points = np.array([scene.solid.vertices[list(e.ends)] for e in scene.solid.edges
                               if e.name in scene.required]).reshape(-1, 3)  # fmt: skip
            image = project(points, np.array(list(aspect.pose)), scene.camera)
            half = np.array([scene.camera.width, scene.camera.height]) / 2
            filled = float((np.abs(image - half + 0.5) / half).max())
            assert filled <= 0.97 + 1e-6
            if at.distance_mm > (lens.minimum_object_distance_mm or 0):
                checked += 1
                assert filled > 0.85  # circles reach farther than the edges' ends
    assert checked


def test_blur_is_diffraction_and_defocus() -> None:
    lens = ListedLens(name="L", kind="telecentric", mount="C", magnification=0.5, working_distance_mm=100.0,
                      f_number=8.0, image_circle_mm=20.0)  # fmt: skip
    aspect = _problem(name="bracket_mm").aspects[0]
    airy = math.sqrt(2) / (2 * math.pi) * 0.55 / (1 / 16)  # sqrt(2) lambda / (2 pi NA)
    disc = 0.5**2 * aspect.half_depth_mm / 8 * 1000  # um, m^2 z / N
    found = blur_um(lens, 8.0, Focused(100.0, 0.5), aspect, 550.0, 0.0)
    assert found == pytest.approx(math.hypot(airy, disc / 4), rel=1e-12)


def test_a_part_that_moves_is_exposed_shortly() -> None:
    found = synthetic(2, 1, 30, 1)
    lens = next(each for each in found.lenses if (each.focal_length_mm or 0.0) >= 16.0)
    light = ListedLight(name="spot", kind="spot", outer_diameter_mm=20.0, radiance=50.0)
    camera = found.sensors[0].model_copy(update={"resolution": (1280, 1024), "pixel_pitch_um": 3.45})
    still, fast = (_problem(name="bracket_mm", speed_mm_s=speed) for speed in (0.0, 500.0))
    one, other = (chosen(camera, lens, light, each.aspects[0], each.wishes, 1.0, 2.0, 300.0) for each in (still, fast))
    assert one.fill == pytest.approx(0.7)
    assert other.exposure_s * 500.0 <= other.pixel_mm * (1 + 1e-9)
    assert other.fill < one.fill
    dark = light.model_copy(update={"radiance": None})
    assert chosen(camera, lens, dark, fast.aspects[0], fast.wishes, 1.0, 2.0, 300.0) == TIME


def test_rolling_shutters_are_for_parts_that_stand() -> None:
    found = synthetic(2, 1, 30, 1)
    lens = next(each for each in found.lenses if (each.focal_length_mm or 0.0) >= 16.0)
    camera = found.sensors[0].model_copy(
        update={"resolution": (1280, 1024), "pixel_pitch_um": 3.45, "shutter": "rolling"}
    )
    light = ListedLight(name="spot", kind="spot", outer_diameter_mm=20.0, radiance=50.0)
    still, fast = (_problem(name="bracket_mm", speed_mm_s=speed) for speed in (0.0, 500.0))
    one, other = (chosen(camera, lens, light, each.aspects[0], each.wishes, 1.0, 2.0, 300.0) for each in (still, fast))
    assert not isinstance(one, str)
    assert other == ROLLING


def test_a_station_of_a_colour_sensor_or_of_a_binned_one_is_that_sensor_s() -> None:
    """Noise and pixels of the scene that is written; a search offers each mode of binning."""
    problem, parts = _problem(name="bracket_mm"), synthetic(2, 1, 30, 1)
    lens = next(each for each in parts.lenses if (each.focal_length_mm or 0.0) >= 16.0)
    plain = parts.sensors[0].model_copy(
        update={"resolution": (1280, 1024), "pixel_pitch_um": 3.45, "sensor_size_mm": None, "diagonal_mm": None}
    )
    coloured = plain.model_copy(update={"name": "colour", "colour": "GRBG", "quantum_efficiency_rgb": (0.3, 0.6, 0.45)})
    binned = plain.model_copy(update={"name": "binned", "binning": [{"kind": "charge"}]})
    kept, out = usable(Catalogue(sensors=(plain, coloured, binned), lenses=(lens,)))
    assert len(kept["sensors"]) == 4
    assert not out["sensors"]
    scene_of = lambda each: station(  # noqa: E731
        problem.scene, chosen(each, lens, OWN_LIGHT, problem.aspects[0], problem.wishes, 1.0, 2.0, 300.0)
    )
    grey, colour, wide = (scene_of(each) for each in (plain, coloured, binned.modes[1]))
    assert grey.noise.colour is None
    assert colour.noise.colour.response == (0.5, 1.0, 0.75)
    assert colour.noise.variance > 1.5 * grey.noise.variance
    assert (wide.camera.width, wide.camera.height, wide.camera.pixel_pitch_um) == (640, 512, 6.9)


def test_what_formulas_do_not_know_of_a_bias_is_not_ok_before_a_render() -> None:
    """A step's walls are lit from beside: only a render knows what light does beside them."""
    camera = scenes.catalogue.load("sample").find("sensors", "Allied Vision Alvium 1800 C-240m")
    lens = scenes.catalogue.load("sample").find("lenses", "FALenses FA5024M12A117")
    for name, alone in (("calibrated_rig", True), ("bracket_mm", False)):
        problem = _problem(name=name)
        seen = views(problem, camera, lens)
        rated = rate_light(problem, camera, lens, OWN_LIGHT, seen)
        states = look(problem, rated).statuses
        assert ("ok" in states) == alone


def test_a_calibration_stays_as_good_in_px() -> None:
    """A parameter's error moves the corner of both images by as many px."""
    one, other = (
        _problem(name="bracket_mm").scene.camera.tried(focal_px=f, width=w) for f, w in ((8e3, 2448), (5e3, 4096))
    )
    told = Covariance(names=("fx", "cx", "k1"), matrix=((4.0, 0.1, 0.01), (0.1, 0.2, 0.0), (0.01, 0.0, 1e-4)))
    made = carried(told, one, other)

    def moved(camera, sd: np.ndarray) -> np.ndarray:
        x = math.hypot(camera.width, camera.height) / 2 / camera.focal_px
        return sd * np.array([x, 1.0, camera.focal_px * x**3])

    assert moved(other, made.sd) == pytest.approx(moved(one, told.sd), rel=1e-12)
    assert made.correlation == pytest.approx(told.correlation, abs=1e-12)


def test_a_risk_is_a_largest_u() -> None:
    scene = scenes.load("bracket_station")
    found = allowed(scene, Wishes(false_acceptance=1e-7))
    risk = global_risks(0.0, 0.004, found[0] / Wishes().coverage, Limits(-0.02, 0.02)).wrong_acceptance
    assert risk == pytest.approx(1e-7, rel=1e-6)
    assert allowed(scene, Wishes(k=2.0))[0] == 0.01
    with pytest.raises(InvalidInput, match="process_sd must be given"):
        allowed(scenes.load("bracket_mm"), Wishes(false_acceptance=1e-3))
    with pytest.raises(InvalidInput, match="tolerance must be given for a measurand at least, got none"):
        allowed(scenes.load("task1"), Wishes())


@pytest.mark.parametrize(
    ("wish", "match"),
    [
        ({"k": 0.0}, "k must be above 0, got 0"), ({"budget": -1.0}, "budget must be above 0"),
        ({"speed_mm_s": -1.0}, "speed_mm_s must be at least 0"), ({"fill": 1.5}, "fill must be above 0 and at most 1"),
        ({"nearest_mm": 300.0, "farthest_mm": 200.0}, "nearest_mm must be less than farthest_mm 200, got 300"),
        ({"false_acceptance": 0.7}, "false_acceptance must be above 0 and at most 0.5, got 0.7"),
    ],
)  # fmt: skip
def test_wishes_are_checked(wish: dict, match: str) -> None:
    with pytest.raises(InvalidInput, match=match):
        Wishes(**wish)


def test_what_another_part_is_no_worse_than_for_less_is_left_out() -> None:
    first = synthetic(1, 1, 1, 1).sensors[0]
    dear = first.model_copy(update={"name": "dear", "price": first.price + 1})
    quiet = dear.model_copy(update={"name": "quiet", "temporal_dark_noise_e": first.temporal_dark_noise_e / 2})
    assert undominated([first, dear, quiet], of_sensor) == [first, quiet]
    dim, bright = (ListedLight(name=n, kind="spot", outer_diameter_mm=9.0, radiance=r, price=5.0)
                   for n, r in (("dim", 10.0), ("bright", 20.0)))  # fmt: skip
    assert undominated([dim, bright], of_light) == [bright]


def test_entries_that_cannot_be_used_are_counted() -> None:
    found = synthetic(1, 3, 2, 2)
    odd = [each.model_copy(update=change) for each, change in zip(
        found.sensors, ({"quantum_efficiency": 40.0}, {"mount": ()}, {"price": None}), strict=True)]  # fmt: skip
    names = ({"name": "large", "resolution": (9000, 7000)}, {"name": "coloured", "colour": True}, {"name": "good"})
    more = [found.sensors[0].model_copy(update=change) for change in names]
    kept, out = usable(found.model_copy(update={"sensors": (*odd, *more)}))
    assert [each.name for each in kept["sensors"]] == ["good"]
    assert out["sensors"] == {CONTRADICTORY: 1, INCOMPLETE: 1, PRICELESS: 1, LARGE: 1, COLOUR: 1}
    with pytest.raises(
        InvalidInput, match="catalogue must have sensors that a station can be made of, got 1 incomplete"
    ):
        design(_problem(), Catalogue(sensors=(odd[1],), lenses=found.lenses, lights=found.lights))


def test_less_noise_and_smaller_pixels_are_no_worse() -> None:
    """The orders that bounds and dominance rely on, of noise alone."""
    problem, found = _problem(), synthetic(11, 1, 40, 1)
    light = ListedLight(name="spot", kind="spot", outer_diameter_mm=20.0, radiance=200.0)
    camera = found.sensors[0].model_copy(update={"resolution": (1280, 1024), "pixel_pitch_um": 4.5})
    lens = next(each for each in found.lenses if each.focal_length_mm in (25.0, 35.0))
    rated = rate(problem, camera, lens, light)
    for change in ({"saturation_capacity_e": 2 * camera.saturation_capacity_e}, {"temporal_dark_noise_e": 0.5},
                   {"resolution": (2560, 2048), "pixel_pitch_um": 2.25}):  # fmt: skip
        other = rate(problem, camera.model_copy(update=change), lens, light)
        assert (limit_ratio(problem, (other.U / problem.wishes.coverage) ** 2) <= rated.ratio * (1 + 1e-9)).all()


def test_what_cannot_be_signed_is_tried_from_elsewhere_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rendering is stood in for: no value is signed at a setting's own place; then none is, or all with too large a U.

    Other places and lights come where values are not signed, the next of the front where they are and U is too large.
    """
    problem, found = Problem.of(scenes.load("bracket_station"), Wishes(k=2.0)), catalogue.load("sample")
    camera, lens = (next(each for each in some if name in each.name)
                    for some, name in ((found.sensors, "C-240m"), (found.lenses, "FA5024")))  # fmt: skip
    light = next(each for each in found.lights if "Flat Dome-100x100" in each.name)
    offer = Offer(1.0, rate(problem, camera, lens, light))
    given = Design(problem, offer, True, (offer,), Tally(1, 1, 1, {}, 1, {}, 1, 1, 1, True), False, (light,))

    def proofs(signed: bool) -> list[tuple[float, float]]:
        def stood_in(_: Design, each: Offer, *more: object) -> SimpleNamespace:
            return SimpleNamespace(offer=each, trusted=signed, holds=each.rated.sensor != offer.rated.sensor)

        monkeypatch.setattr(designed, "prove", stood_in)
        monkeypatch.setattr(alternatives, "look", lambda *_: SimpleNamespace(ratio=0.5))
        best, tried = designed.proven(given, 0)
        assert best.best.rated.sensor == tried[-1].offer.rated.sensor or not tried[-1].holds
        return [tuple(each.offer.rated.sensor) for each in tried]

    own = tuple(offer.rated.sensor)
    assert proofs(signed=True) == [own]
    there, other = proofs(signed=False)
    assert there == own != other


def test_a_pair_whose_close_look_fails_is_tried_with_its_next_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """Close looks are stood in for: only the dearer lens under the second light meets all when it is looked at so.

    Its first light passes at a glance, and is known to show the edges by the cheaper lens, so that only the last look
    contradicts it.
    """
    told = {("narrow", "a"): 2.0, ("narrow", "b"): 2.0, ("wide", "a"): 2.0, ("wide", "b"): 0.5}

    def stood_in(_: Problem, rated: Rated) -> Close:
        return Close((), ("ok",), told[rated.names[1:]], 0, 0.5)

    for module in (search, ahead):
        monkeypatch.setattr(module, "look", stood_in)
    given = synthetic(11, 1, 40, 1)
    glass = next(each for each in given.lenses if each.focal_length_mm == 25.0)
    lenses = [glass.model_copy(update={"name": name, "price": price, "format": None, "image_circle_mm": circle})
              for name, price, circle in (("narrow", 50.0, 30.0), ("wide", 60.0, 40.0))]  # fmt: skip
    lamps = [ListedLight(name=name, price=price, kind="spot", outer_diameter_mm=wide, radiance=200.0)
             for name, price, wide in (("a", 10.0, 20.0), ("b", 20.0, 21.0))]  # fmt: skip
    parts = given.model_copy(update={"lenses": tuple(lenses), "lights": tuple(lamps)})
    found = design(_problem(2.0), parts)
    assert found.reached
    assert found.best.rated.names[1:] == ("wide", "b")


def _offers(*ratios: float) -> list[Offer]:
    """By rising cost, with ratios that a search tells."""
    return [Offer(float(k), SimpleNamespace(ratio=ratio)) for k, ratio in enumerate(ratios)]


def test_as_many_of_the_front_are_rendered_as_are_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The best first, then what is dearer and meets all, then what is cheaper, the dearest of it first."""
    offers = _offers(2.0, 1.2, 0.9, 0.8)
    given = Design(_problem(), offers[2], True, tuple(offers), Tally(1, 1, 1, {}, 1, {}, 1, 1, 1, True), False)

    def tried(wanted: int, *wrong: int) -> tuple[list[float], float]:
        def stood_in(_: Design, each: Offer, *more: object) -> SimpleNamespace:
            return SimpleNamespace(offer=each, trusted=True, holds=each not in [offers[k] for k in wrong])

        monkeypatch.setattr(designed, "prove", stood_in)
        found, proofs = designed.proven(given, 0, wanted=wanted)
        return [each.offer.cost for each in proofs], found.best.cost

    assert tried(1) == ([2.0], 2.0)
    assert tried(1, 2) == ([2.0, 3.0], 3.0)
    assert tried(1, 2, 3) == ([2.0, 3.0], 2.0)
    assert tried(3) == ([2.0, 3.0, 1.0], 2.0)
    assert tried(3, 2) == ([2.0, 3.0, 1.0, 0.0], 3.0)


@pytest.mark.parametrize(
    ("told", "rendered", "signed", "agrees", "holds"),
    [(0.9, 0.99, True, True, True), (0.9, 1.01, True, True, False), (1.2, 1.25, True, True, True),
     (1.2, 1.3, True, True, False), (0.9, 0.9, False, True, False), (0.9, 0.9, True, False, False)],
)  # fmt: skip
def test_a_proof_holds_where_all_is_as_told(
    told: float, rendered: float, signed: bool, agrees: bool, holds: bool
) -> None:
    budget = SimpleNamespace(statuses=("ok", "ok" if signed else "clutter"))
    run = SimpleNamespace(verdict=SimpleNamespace(agrees=agrees))
    assert designed.StationProof(_offers(told)[0], budget, rendered, run).holds is holds
