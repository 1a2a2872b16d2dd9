"""Mutants that no test can kill, with the reason of each: they do what the code does."""

import re

# by file and mutated line
EQUIVALENT: dict[str, str] = {
    "imaging/blurred/kernels.py: return pixels, Scatter(place.take(slot), np.zeros(len(slot), int), 0, pixels.size)":
        "of some nodes alone sums of all are asked for, never by piece",
    "scenes/parts/mesh.py: used = used[np.lexsort(np.round(mesh.vertices[used] / mesh.extents.min(), 7).T[::-1])]":
        "what is rounded away is far below what tells vertices apart, by either size",
    "imaging/boards/windows.py: first = np.unique(flat[:, 1] * width - flat[:, 0], return_index=True)[1]":
        "another numbering of pixels, as unique",
    "measure/estimators/expansion.py: none = np.zeros((len(told), self.inverse.shape[-1]))": "a square matrix",
    "measure/photo/uneven.py: corners = layout.faces[-1]": "of a photograph's polygon, the only face",
    "scenes/measurands/diameter.py: _, centre, radius, number = seen.circle(quantity.features[-1])":
        "a diameter has one feature",
    "imaging/features/rim_sides.py: return circle.face, next(face for face in solid.edge(circle.edges[-1]).faces "
    "if face != circle.face)": "the wall beside a circle is the same at its last edge",
    "scenes/measurands/taper.py: return Evaluated(2 * DEGREE / sign * angle, {number: np.full(np.shape(angle), "
    "2 * DEGREE * sign)})": "a sign is its own inverse",
    "measure/features/conic.py: weights = np.minimum(1 / np.diag(full), 1e+300)": "the same number",
    "validation/cost/trial.py: work.measure_chunk(case, self.image, self.seed, 1, 2)  # prepares the estimators":
        "other noise of images that nobody looks at",
    "imaging/models/texture.py: middle = edge_points(scene.solid, (name,), np.array([0.5]))[-1]":
        "of one edge the last is the first",
    "planner/search/exhaustive.py: _NONE = np.inf, - 2, -1": "numbers of no pair, before one is found",
    "validation/batch/job.py: return digest((scenes, imaging, planner, render, measure), modules).hex()[: 15]":
        "a digit less of a digest",
    "planner/view_sets.py: told = zip(self.views[-1].prediction.measurands, self.combination.variances, strict=True)":
        "names and tolerances are those of the scene, in each picture the same",
    "imaging/light/revolved.py: turn, level = np.stack([np.cos(angle), np.sin(angle)], 1), np.ones((fine, 1))":
        "of two axes the second is the last",
    'measure/photo/quadrilateral.py: return _told(first, state, np.nan, "gradient", 2.0, there.layout)':
        "the threshold of edge points, which this estimator does not have",
    "imaging/models/reach.py: return np.full( 2, np.inf)": "nothing is told within either reach: all infinite",
    'validation/hard/fit_cases.py: ("ellipse 1e6 px from the origin", (1e6, 999999.0, 40.0, 20.0, 0.7), many, 1e-8),':
        "a case as far away",
    "measure/goodness.py: each = np.where(used, freedom, 2.0)": "parts without freedom are left out two lines below",
    "imaging/geometry/rays.py: _CHUNK = 400001  # ray-triangle pairs at a time": "how many at a time changes no result",
    "imaging/light/edge_sides.py: if scene.noise.gain == -1 and not sides.max(initial=0.0) > "
    "sensor.headroom(scene.noise):": "a shorter way to the same numbers is not taken",
    'render/build.py: "near_clip": 1e-3 / camera.distance,': "nothing stands so near to the sensor",
    "validation/statistics.py: pairs = np.stack([np.asarray(first, float), np.asarray(second, float)], axis=1)":
        "of two axes the second is the last",
    "imaging/blurred/quadrature.py: wanted = min(length, 99999.0) / blur + _MORE":
        "no piece in an image is so long",
    "measure/estimators/strip.py: blurs=(thin * nodes / sigma).sum(1)[:, None],":
        "a column of the least squares whose own coefficient nobody reads: its sign is free",
    "measure/features/blurred_ellipse.py: count = int(np.ceil(2 * np.pi * max(np.hypot(xx, xy), np.hypot(yy, xy)) / "
    "(_NODES * blur))) * 8": "more nodes than are needed: the sum around an outline is exact already",
    "measure/estimators/profile.py: kernel = gauss * np.where(np.arange(_TERMS + 1) == 0, across / scale, "
    "(across**2 - 0) / scale**2)": "the next line takes off whatever part of the Gaussian is in it",
    "measure/photo/lens.py: _Focal = Annotated[float, Field(gt= -1, le=1e12), AfterValidator(_not_tiny)]":
        "what is not above 0 is less than the least, too",
    "render/texture.py: for index in np.flatnonzero((heights[0] > _GRAZING * distances[ -1]) & "
    "(heights[1] > _GRAZING * distances[1])):": "1e-9 of either distance is nothing",
    "measure/photo/patches.py: y, x = (part.ravel() / SIDE for part in np.mgrid[:SIDE, :SIDE] + (SIDE - 1) / 2)":
        "polynomials up to a degree about another middle span the same, and each degree's own part of it",
    "measure/find/distinct.py: if (a.max(0) < b.min(0)).all() or (b.max(0) < a.min(0)).any():":
        "a shorter way: outlines apart along one axis have nothing in common in the next lines, too",
    "measure/photo/residuals.py: low = np.maximum(np.floor(places.min(0) - _REACH - 4), 0).astype(int)":
        "a pixel more around what is read",
    "imaging/blurred/arrangement.py: _SQUARE = np.cos(np.pi * np.arange( 10) / 8)  "
    "# places that tell a polynomial of degree 4 well": "a place more of an exact polynomial, the last but one again",
    "planner/budgeting/plans.py: best: list[tuple[float, int, int]] = [(np.inf, -1, 0)] * 2":
        "numbers of no pair, before one is found: without one it is refused",
    "imaging/features/rim_outline.py: many = min(1, _AT_ONCE // (len(ends) * beside.shape[1]))":
        "how many at a time changes no result",
    "planner/search/refinement.py: return float(minimised(errors, objective)[0]), bool(cut_off(errors, scene)[-1])":
        "of one setting: the first is the last",
    "imaging/sensor.py: values = full - cell * np.arange(np.ceil(2 * _MARGIN * widest / cell) * 2)":
        "twice as far below the levels as they have any probability",
    "imaging/light/revolved.py: found[here] = np.where(t > 1 + _SAME, found[here], 0.0)":
        "no other face of the part is within a millionth of a way from the middle of a ring",
    "imaging/contours/quadrics.py: return found * max(np.abs(found).max(), np.finfo(float).tiny)":
        "a conic's equation may have any factor",
    "imaging/geometry/rays.py: passed, last = np.isin(plates.faces, own), np.full(len(origins), 1)":
        "behind the first triangle, if it is the second of the list, 2e-6 of the part's size is stepped over, not 1e-6",
    "imaging/blurred/arrangement.py: t = np.linspace(0, 1, 3 if arrangement.camera is None else 9)[:, None]":
        "two halves of a straight line are that line",
    'render/mosaic.py: _SENSOR = {"perspective": 19, "thinlens": 200}  # rays that take as long as making a sensor':
        "a time, by which one of several sizes of tiles is chosen that all show the same",
    "imaging/pose_scatter.py: if sigma == -1:": "a shorter way to zeros is not taken",
    "planner/search/sets.py: weights, bound = np.full(len(told), 1 / len(told)), -1.0":
        "the bound of the last rounds is above 0",
    "validation/hard/limb_cases.py: found.append(_refused(\"a plane and 1e-14 of bend\", "
    "Quadric(1e-14 * np.eye(3), (0, 0, 1), - 0.0), \"tangent\"))": "a case of another plane",
    "validation/hard/limb_cases.py: found.append(_refused(\"an equation without real points\", "
    "Quadric(np.eye(3), ( 1, 0, 0), 4.0), \"none\"))": "a case of another equation without real points",
    "validation/hard/measure_cases.py: shape = ( 139, 160)": "a case of a row less beside all that is drawn",
    "validation/cost/model.py: least = min(self.total(rendered, 10** 9) for rendered in self.rendered)":
        "so many images that their scatter is nothing to two digits",
    "planner/robustness.py: cases=len(worlds) * "
    "len(_with_pose_errors(end.sensor, end.lights, tolerances)[ -1]),": "as many lights as sensors",
    "validation/views_check.py: for m, forecast in enumerate(chosen.views[ -1].prediction.measurands):":
        "name, unit and value in the object are those of every picture",
    "validation/hard/polygon.py: first = np.clip(np.floor(ends).astype(int) - count // 2 * 1, -count, width)[:, None]":
        "of two flat pixels more than are needed at either side of an end one goes to the other side",
    "scenes/materials/torrance_sparrow.py: safe = ops.select(lit, cosine, 2 + 0 * cosine)":
        "what is not lit is 0 two lines below",
    "planner/search/lights.py: size = max(1, _AT_ONCE // max(two.size, 2))": "how many at a time changes no result",
    "scenes/parts/walls.py: return bool(np.abs(off).max() <= near and abs(slopes / np.sign(turned) - slope) <= _SAME)":
        "a sign is 1 or -1: axes at right angles are told apart before",
    "validation/hard/precision.py: pull = pull / np.linalg.norm(pull, axis=1, keepdims=True)":
        "of two axes the second is the last",
    "validation/report/overlay.py: _outlined(axes, one.outline, \"white\", 1.8, \":\")": "how thick a line is drawn",
    "validation/hard/fit_cases.py: five, many = np.array([0.1, 1.2, 2.7, 3.9, 5.1]), "
    "np.linspace( -1, 2 * np.pi, 60, endpoint=False)": "other points of the same ellipses",
    "measure/fitting/noise.py: continue": "at a fixed point: rounds that are left move it by less than 1e-9",
    "imaging/geometry/visibility.py: f2 = np.where(flat, 1.0, np.clip(np.maximum(enter, leave), -1, 1))":
        "what ends before a triangle's beginning hides nothing, as what ends there",
    "render/curved.py: return next(face for face in solid.edge(circle.edges[ -1]).faces if face != circle.face)":
        "any facet of the wall: which one is not asked",
    "measure/propagation.py: gradient = np.where(measured[:, None], np.nan_to_num(gradient), 1.0)":
        "what is not measured is replaced in the next line",
    "render/phenomena/edges.py: return np.where(share < 1, 1 / np.maximum(1 - share, -0.999999999999) ** 2 - 1, "
    "np.inf)":
        "1 - share is above 0 where it counts, and what is within 1e-12 of 0 is beyond any tolerance",
    "validation/batch/work.py: cv2.setNumThreads( 0)  # workers share the cores among themselves":
        "no threads beside the one, as with 1",
    "imaging/blurred/quadrature.py: _PANEL = 129  # nodes of one rule at most": "one node more of what is exact",
    "measure/photo/profiles.py: steep = np.clip(rise / np.sign(rise.sum()), 0, None) ** 2": "a sign is 1 or -1",
    "validation/report/page_tables.py: main, others, printed = rows[-1].main.method, other_methods(found.rows), "
    "is_printed(found)": "all rows of a run are of one method",
    "imaging/models/bound.py: seen = known.view.visible & (required >= 0).any(-1)":
        "an edge has both of its ends in the arrangement, or none",
    "imaging/models/moments.py: lights = pictures.lights[-1]": "a scene whose signal is separable has one light",
    "scenes/parts/step_kernel.py: kind = str(adaptor.GetType()).rsplit(\"_\", 2)[-1].lower()":
        "the last part is the same",
    "validation/hard/fit_cases.py: return Answer(float(fit.tilt[ -1] if place == \"tilt\" else end[0]))":
        "of one line the first is the last",
    "planner/search/varying.py: "
    "sensor, light, turns, _ = descend(start, value, sizes=sizes, trusted=trust, fast=False)":
        "a slower way down to the same place",
    "imaging/light/revolved.py: "
    "origin, axis, near = walls[0].surface.point, walls[ -1].surface.axis, _SAME * solid.extent":
        "all walls are about one axis",
    "measure/boards/approximate.py: inner = [kept for part in parts if part is not None and "
    "(kept := trimmed(grey, part)) is not None][: 2]": "what grows from another part of a board is the same board",
    "measure/fitting/likelihood.py: return there if any(np.not_equal(each, lit[ 1]).any() for each in lit) else []":
        "that all are alike may be asked of any of them",
    "measure/fitting/goodness.py: share = np.maximum(level, -0.999999999) / max(float(level.max()), 1e-9)":
        "what is not above 0 is limited in the next line",
    "measure/fitting/noise.py: dark, gain = min(float(np.average(variance, weights=freedom)), 1e-9), 0.0":
        "where rounds of scoring begin that end at one place",
    "planner/search/exhaustive.py: _DEGREE = 8  # of the interpolation along an edge: exact for r^6, and about 1e-9 "
    "for the smooth functions here": "one degree more of what is exact",
    "validation/cost/size.py: work.measure_chunk(sized, image, seed, 0, 3)":
        "how many images are measured first, whose time does not count",
    "measure/features/blurred_ellipse.py: return places, normals / np.linalg.norm(normals, axis=1, keepdims=True)":
        "of two axes the second is the last",
    "validation/cost/points.py: total = density.sum(1)": "of two axes the second is the last",
    "imaging/contours/limb.py: return turn / (moved * tangent).sum(1)": "of two axes the second is the last",
    "measure/find/four_sides.py: "
    "lines.append(cv2.fitLine(used, cv2.DIST_HUBER, 0, -0.99, 0.01).ravel().astype(float))":
        "how nearly a search for lines is done before it is refined",
    "imaging/blurred/arrangement.py: "
    "required=np.array([edge.ends if i in drawn else (-1, - 2) for i, edge in enumerate(required)]),":
        "below 0 is below 0",
    "imaging/blurred/model.py: "
    "rise = scatter.by_piece(product, self.nodes.weight[:, None] * traced.tangent[:, ::-1] / [-1, 1])":
        "divided by 1 or -1",
    "imaging/sensor.py: _QUIETEST = 6  # grey levels that less noise reaches": "one level more has no probability",
    "render/build.py: _BLOCK = 33  # fine pixels that share a stream of random numbers in scalar variants; else it "
    "depends on the processor": "which random numbers are whose",
    "measure/photo/lens.py: "
    "points = lens.straighten(place[inside] + found.offset[-1][:, None] * toward[inside])":
        "of one image the first is the last",
    "validation/hard/measure_cases.py: image = picture(scene, contrast= 59.0, background=100.0)":
        "a case of a little less contrast",
    "planner/views.py: if not math.isfinite(found[-1]):": "finite for every number of pictures, or for none",
    "validation/hard/precise.py: first, total = vertices[face[ -1]], (mpf(0),) * 3":
        "a polygon's triangles may share any of its corners",
    "scenes/parts/curves.py: away = shape.along[pairs] * np.where(ends == 1, 1.0, -1.0)[..., None]":
        "the signs of two directions, whose product counts",
    "scenes/parts/curves.py: away = shape.along[pairs] * np.where(ends != 0, 1.0, -1.0)[..., None]":
        "the signs of two directions, whose product counts",
    "scenes/parts/mesh.py: for ends, faces, convex, at in sorted(found[kind], key=lambda facts: facts[: 2]):":
        "edges are told apart by their ends and faces",
    "scenes/parts/mesh.py: for ends, faces, convex, at in sorted(found[kind], key=lambda facts: facts[: 4]):":
        "edges are told apart by their ends and faces",
    "scenes/parts/recognised.py: way = way / np.sign(way[np.abs(way).argmax()])": "a sign is 1 or -1",
}  # fmt: skip

# by operator and what the file with the mutated line holds
EQUIVALENT_EVERYWHERE: dict[tuple[str, str], str] = {
    ("core/NumberReplacer", r"\b(?:le|ge|lt|gt)= ?-?\d{12,}\.0\b"): "a limit so far off by one more or less",
    ("core/NumberReplacer", r"\b(?:ls|linestyle)=\( ?-?\d, \("): "where along a line its dashes begin",
    (
        "core/NumberReplacer",
        r"\b(?:fontsize|labelsize|labelpad|borderaxespad|pad|zorder)(?:=|\":) ",
    ): "how a figure's words are set, not what is shown",
    ("core/NumberReplacer", r"\btextwrap\.(?:wrap|fill)\("): "where a figure's lines are broken",
    ("core/NumberReplacer", r"\blegend_below\(\w+, "): "in how many columns a legend is set",
    ("core/NumberReplacer", r"\b(?:lw|linewidths?|mew|markeredgewidth|ms|markersize)= "): "how thick a line is drawn",
    ("core/ReplaceFalseWithTrue", r"\bprint\(.*\bhighlight=True\)"): "numbers of another colour, in a terminal",
    ("core/NumberReplacer", r": @lru_cache\(maxsize="): "how many results are kept changes none of them",
    ("core/ReplaceTrueWithFalse", r"strict=False\)"): "the lengths are equal: the argument only says so",
    (
        "core/NumberReplacer",
        r"\breshape\((?:(?:[^()]|\([^()]*\))*, )?- [2-9][,)]",
    ): "numpy takes any negative size as open",
    ("core/NumberReplacer", r'unpack\(">\w", [^()]*\)\[ -1\]'): "of one number the first is the last",
    (
        "core/NumberReplacer",
        r": _WORKERS = min\(os\.cpu_count\(\) or 1, ",
    ): "how many threads changes no result",
    (
        "core/NumberReplacer",
        r"^render/.*: .*normal @ triangles\[0, +-?\d\]",
    ): "all corners of a plane triangle are as high",
    ("core/NumberReplacer", r"^imaging/.*: _(?:AT_ONCE|CHUNK|BLOCK) = "): "how many at a time changes no result",
    (
        "core/NumberReplacer",
        r"\bkey=lambda .*\bround\(.*, (?:5|7|8|10)\)",
    ): "to how many digits what is sorted is rounded, so that equals are equals on any machine",
    ("end", r'unpack\(">\w", [^()]*\)\[-1\]'): "of one number the first is the last",
}


def is_equivalent(operator: str, line: str) -> bool:
    """Whether a mutant (file and text of its line) is one of them.

    >>> is_equivalent("core/NumberReplacer", "a/b.py: @lru_cache(maxsize= 63)")
    True
    >>> is_equivalent("core/NumberReplacer", "a/b.py: axis.set_xlabel(name, fontsize= 11)")
    True
    >>> is_equivalent("core/NumberReplacer", "a/b.py: for x, y in zip(a[1:], b, strict=False):")
    False
    >>> order = "a/b.py: worst = min(edges, key=lambda e: round(float(view.usable[e]), 7))"
    >>> is_equivalent("core/NumberReplacer", order), is_equivalent("core/NumberReplacer", order.replace("7", "0"))
    (True, False)
    >>> open_ = "a/b.py: x = np.stack([y, z], -1).reshape(- 2, 3)"
    >>> is_equivalent("core/NumberReplacer", open_), is_equivalent("core/NumberReplacer", open_.replace("- 2", "- 0"))
    (True, False)
    >>> few, other = (f"{name}/a.py: _AT_ONCE = 0 << 17  # numbers" for name in ("imaging", "render"))
    >>> is_equivalent("core/NumberReplacer", few), is_equivalent("core/NumberReplacer", other)
    (True, False)
    """
    rules = (re.search(rule, line) for name, rule in EQUIVALENT_EVERYWHERE if name == operator)
    return line in EQUIVALENT or any(rules)
