"""The faces and edges of a part that a STEP file's shape aspects are: what dimensions, tolerances and datums are of."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from scenes.parts.part21 import Part21, Reference, Typed, number_at

SIZES = ("DIMENSIONAL_SIZE", "ANGULAR_SIZE", "DIMENSIONAL_SIZE_WITH_PATH")
LOCATIONS = ("DIMENSIONAL_LOCATION", "ANGULAR_LOCATION", "DIRECTED_DIMENSIONAL_LOCATION",
              "DIMENSIONAL_LOCATION_WITH_PATH")  # fmt: skip
_FACES, _BOUNDS = ("ADVANCED_FACE", "FACE_SURFACE"), ("FACE_OUTER_BOUND", "FACE_BOUND")
_DEEPEST = 16  # aspects of aspects


@dataclass(frozen=True, eq=False)
class Aspects:
    """A file's shape aspects: each has usages of faces or edges, or is composed of others."""

    part: Part21

    def faces(self, aspect: int | None) -> tuple[int, ...]:
        """Numbers of the faces of a shape aspect, or of what a dimension is of."""
        return tuple(dict.fromkeys(self._faces(aspect, set(), 0)))

    def _faces(self, aspect: int | None, seen: set[int], deep: int) -> Iterator[int]:
        return (item for item in self._of_aspect(aspect, seen, deep) if self._is_face(item))

    def shown(self, aspect: int | None) -> tuple[int, ...]:
        """Numbers of the faces that a dimension is of; of one of edges those beside them."""
        return self.faces(aspect) or self._beside(aspect)

    def _beside(self, aspect: int | None) -> tuple[int, ...]:
        """Numbers of the faces beside the edges that a dimension is of."""
        edges = [item for item in self._of_aspect(aspect, set(), 0) if not self._is_face(item)]
        return tuple(dict.fromkeys(face for edge in edges for face in self._faces_at[edge]))

    def _of_aspect(self, aspect: int | None, seen: set[int], deep: int) -> Iterator[int]:
        """Numbers of the faces and edges of a shape aspect and its parts."""
        if aspect is None or aspect in seen or deep > _DEEPEST:
            return
        seen.add(aspect)
        yield from self._usages[aspect]
        for part in self._parts[aspect]:
            yield from self._of_aspect(part, seen, deep + 1)
        here = self.part[aspect]
        if here.of(*SIZES) is not None:
            yield from self._of_aspect(number_at(here.of(*SIZES) or (), 0), seen, deep + 1)

    @cached_property
    def _faces_at(self) -> dict[int, list[int]]:
        """Numbers of the faces on both sides of each edge."""
        edge_of = {number: self._refers("ORIENTED_EDGE", number, 3) for number in self.part.numbers("ORIENTED_EDGE")}
        loops = {number: self._refers("EDGE_LOOP", number, 1) for number in self.part.numbers("EDGE_LOOP")}
        bounds = {number: self._refers(_BOUNDS, number, 1) for number in self.part.numbers(*_BOUNDS)}
        found: dict[int, list[int]] = defaultdict(list)
        for face in self.part.numbers(*_FACES):
            for bound in self._refers(_FACES, face, 1):
                for edge in (edge for loop in bounds.get(bound, ()) for used in loops.get(loop, ())
                             for edge in edge_of.get(used, ())):  # fmt: skip
                    found[edge].append(face)
        return found

    def _refers(self, kinds: str | tuple[str, ...], number: int, place: int) -> tuple[int, ...]:
        """The references that stand at one place of an instance's parameters."""
        told = self.part[number].of(*((kinds,) if isinstance(kinds, str) else kinds)) or ()
        items = told[place] if len(told) > place else ()
        return tuple(each for each in (items if isinstance(items, tuple) else (items,)) if isinstance(each, Reference))

    @cached_property
    def _usages(self) -> dict[int, list[int]]:
        """Numbers of faces and edges by shape aspect."""
        found: dict[int, list[int]] = defaultdict(list)
        kinds = ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE")
        for number in self.part.numbers(*kinds):
            told = self.part[number].of(*kinds) or ()
            aspect, items = number_at(told, 2), told[4] if len(told) > 4 else ()
            if aspect is not None:
                items = items.value if isinstance(items, Typed) else items  # SET_REPRESENTATION_ITEM
                items = items if isinstance(items, tuple) else (items,)
                found[aspect] += [item for item in items if isinstance(item, Reference) and self._is_shown(item)]
        return found

    def _is_face(self, number: int) -> bool:
        return self.part.texts.get(number, "").lstrip().startswith(_FACES)

    def _is_shown(self, number: int) -> bool:
        return self._is_face(number) or self.part.texts.get(number, "").lstrip().startswith("EDGE_CURVE")

    @cached_property
    def _parts(self) -> dict[int, list[int]]:
        """Shape aspects that another is composed of."""
        found: dict[int, list[int]] = defaultdict(list)
        for one, other in self._related:
            if "DATUM" not in self.part[other].entities:  # a feature establishes a datum, and is not made of it
                found[one].append(other)
        return found

    @cached_property
    def owners(self) -> dict[int, list[int]]:
        """Shape aspects that are related to another."""
        found: dict[int, list[int]] = defaultdict(list)
        for one, other in self._related:
            found[other].append(one)
        return found

    @cached_property
    def _related(self) -> list[tuple[int, int]]:
        kinds = ("SHAPE_ASPECT_RELATIONSHIP", "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP")
        found = [self.part[number] for number in self.part.numbers(*kinds)]
        told = [each.of(*kinds) or () for each in found if each.of(*LOCATIONS) is None]  # a dimension joins nothing
        pairs = [(number_at(each, 2), number_at(each, 3)) for each in told]
        return [(one, other) for one, other in pairs if one is not None and other is not None]
