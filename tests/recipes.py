"""Recipes beside the program: loaded without their folder's code, and whether both answer the same."""

import numpy as np
import pytest

import measure
from validation import inspection
from validation.cli.measurands import facts
from validation.recipe.runtime import Recipe
from validation.strict_json import dumps, plain


def loaded(made, folder):
    (folder / "facts.json").write_text(dumps(plain(made.facts)))
    (folder / "formulas.py").write_text(made.formulas)
    np.savez(folder / "arrays.npz", **made.arrays)
    return Recipe.load(folder)


def _program(image, picture, correction):
    found = measure.measure(image, picture, estimator="gradient")
    if correction is not None and np.isfinite(found.value).any():
        found = measure.corrected(found, correction, image)
    told = inspection.inspect(found)
    return facts(told), plain(told.covariance)


def same(recipe, image, picture, correction):
    """That a recipe answers as the program does, to 1e-12 of each number."""
    found, (rows, covariance) = recipe.measure(image), _program(image, picture, correction)
    for mine, own in zip(found["measurands"], rows, strict=True):
        assert mine.keys() <= own.keys()
        numbers = {key for key in mine if isinstance(mine[key], float) and isinstance(own[key], float)}
        for key in mine.keys() - numbers:
            assert mine[key] == own[key], (key, mine, own)
        for key in numbers:
            assert mine[key] == pytest.approx(own[key], rel=1e-12, abs=1e-12 * (own["sigma"] or 0.0)), (key, mine, own)
    np.testing.assert_allclose(
        np.array(found["covariance"], float), np.array(covariance, float), rtol=1e-11, atol=1e-25
    )
    return [each["status"] for each in found["measurands"]]


def noisy(clean, picture, rng, light=1.0):
    """As recorded under so many times the light."""
    noise = picture.scene.noise
    signal = light * (clean - noise.dark_level)
    sigma = np.sqrt(noise.sigma**2 + noise.gain * np.maximum(signal, 0))
    return np.clip(np.rint(noise.dark_level + signal + sigma * rng.standard_normal(clean.shape)), 0, 255)
