"""Cameras, lenses and lights as they are bought: tables in a data sheet's own words."""

from scenes.catalogue.catalogue import SAMPLE, Catalogue, find, load
from scenes.catalogue.entry import Contradiction, Entry
from scenes.catalogue.lens import ListedLens
from scenes.catalogue.light import ListedLight
from scenes.catalogue.sensor import ListedSensor

__all__ = ["SAMPLE", "Catalogue", "Contradiction", "Entry", "ListedLens", "ListedLight", "ListedSensor", "find", "load"]
