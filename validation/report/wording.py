"""What is said of requirements, in plain words: what is measured, how well, what is wrong, what to do next."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from enum import StrEnum

from scenes.status import MEANINGS, REMEDIES, WORST_FIRST, is_trusted
from validation.report import cells, source_words
from validation.report.requirements import HALF, WELL, Grade, Requirement

_NAMED = 4  # requirements that a sentence names
_UNCERTAINTY = "the uncertainty U (95 %) of the measurement"  # where U is first spoken of
_NO_TOLERANCE = (
    "give each requirement its tolerance, the key `tolerance` of its `[[measurands]]` table in the scene file (the "
    "short form `[task]` has no such key), so that U can be compared with it"
)


class Need(StrEnum):
    """Whether something has to be done."""

    ACT = "act"
    MAY = "may"
    NONE = "none"


def what(found: Sequence[Requirement]) -> str:
    """What is measured.

    >>> what([])
    'Nothing'
    """
    kinds = Counter(each.kind for each in found)
    parts = [f"{count} {kind}{'s' * (count > 1)}" for kind, count in kinds.items()]
    return f"{', '.join(parts[:-1])} and {parts[-1]}" if len(parts) > 1 else "".join(parts) or "Nothing"


def sentence(found: Sequence[Requirement]) -> str:
    """How well all of them are measured; of the part itself it says nothing."""
    parts = []
    for grade in (Grade.WELL, Grade.WITHIN, Grade.OVER, Grade.OPEN, Grade.DOUBT, Grade.MISSING):
        if some := [each for each in found if each.grade == grade]:
            subject = _count(len(some), len(found)) if grade == Grade.WELL else _which(some, found)
            parts.append(f"{subject} {_how(grade, some)}")
    said = ". ".join(part[0].upper() + part[1:] for part in parts) + "."
    return said.replace(" U is ", f" {_UNCERTAINTY} is ", 1)


def _how(grade: Grade, some: Sequence[Requirement]) -> str:
    """Of requirements of one grade."""
    if grade == Grade.WELL:
        return f"measured precisely enough: U is at most {100 * WELL:.0f} % of {HALF}"
    if grade == Grade.WITHIN:
        return f"usable, but less precise than aimed at: U is {_most(some)}"
    if grade == Grade.OVER:
        return f"measured too uncertainly: U is larger than {HALF}"
    if grade == Grade.OPEN:
        return f"measured{_known(some)}; no tolerance is given to compare with"
    if grade == Grade.MISSING:
        states = {each.status for each in some}
        return f"not measured: {MEANINGS[states.pop()] if len(states) == 1 else 'they have no value'}"
    return f"not proven: {'its value' if len(some) == 1 else 'their values'} must not be relied on"


def _most(some: Sequence[Requirement]) -> str:
    """The largest U of some that are usable, against their tolerances."""
    return f"{'up to ' * (len(some) > 1)}{cells.percent(max(each.ratio or 0.0 for each in some))} of {HALF}"


def _known(some: Sequence[Requirement]) -> str:
    """The uncertainty of what has no tolerance, where that is one number."""
    if len(some) != 1 or some[0].U is None:
        return ""
    return f" with an expanded uncertainty U (95 %) of {some[0].U:.2g} {some[0].unit}"


def wrong(found: Sequence[Requirement]) -> list[str]:
    """What is wrong, a line for each status that is not ``ok``, each U that is too large, and what has no tolerance;
    empty where nothing is."""
    lines = []
    for status in WORST_FIRST:
        some = [each for each in found if each.status == status and not is_trusted(status)]
        if some:
            told = next((each for each in some if each.reason), None)
            about = f"{f'of {told.title}, ' if len(some) > 1 else ''}{told.reason}" if told else MEANINGS[status]
            lines.append(f"{_named(some, found)}, status {status}: {about}.")
    for each in found:
        if each.grade == Grade.OVER and each.ratio is not None:
            lines.append(f"{_named([each], found)}: U is {each.ratio:.2g} times {HALF}{_mostly(each)}.")
    if some := [each for each in found if each.grade == Grade.OPEN]:
        whose = "" if len(some) == len(found) else f" for {_named(some, found)}"
        lines.append(f"no tolerance is given{whose}: whether U is small enough cannot be told.")
    return [line[0].upper() + line[1:] for line in lines]


def nothing_wrong(found: Sequence[Requirement]) -> str:
    """What is said where nothing is wrong: also which are usable only, and how precise they are."""
    within = [each for each in found if each.grade == Grade.WITHIN]
    if not within:
        return "Nothing."
    return f"Nothing is wrong: {_which(within, found)} usable (U is {_most(within)})."


def next_step(found: Sequence[Requirement]) -> str:
    """What to do about what is wrong, the worst first; then about the largest uncertainty."""
    steps = []
    for status in WORST_FIRST:
        some = [each for each in found if each.status == status and not is_trusted(status)]
        if some:
            steps.append(f"{_named(some, found)}: {REMEDIES[status]}.")
    if over := _largest(found, Grade.OVER):
        steps.append(f"{_named([over], found)}: {_reduced(over)}.")
    if any(each.grade == Grade.OPEN for each in found) and not steps:
        steps.append(f"{_NO_TOLERANCE}.")
    steps = [step[0].upper() + step[1:] for step in steps] or [
        "Nothing has to be changed: set camera and lamp up at the places given here."
    ]
    within = _largest(found, Grade.WITHIN)
    if within and need(found) == Need.MAY:
        steps.append(f"For a smaller U of {_named([within], found)}: {_reduced(within)}.")
    return " ".join(steps)


def need(found: Sequence[Requirement]) -> Need:
    """Whether what `next_step` says has to be done, may be, or is nothing."""
    grades = {each.grade for each in found}
    if any(grade.fails for grade in grades):
        return Need.ACT
    return Need.MAY if grades & {Grade.OPEN, Grade.WITHIN} else Need.NONE


def _largest(found: Sequence[Requirement], grade: Grade) -> Requirement | None:
    """Of a grade the one with the largest U beside its tolerance."""
    some = [each for each in found if each.grade == grade]
    return max(some, key=lambda each: (round(each.ratio or math.inf, 9), -each.number), default=None)


def _reduced(each: Requirement) -> str:
    """What makes an uncertainty smaller."""
    if not each.source:
        return "expose longer, come nearer, or take more pictures"
    return f"most of U comes from {source_words.words(each.source)}; {source_words.smaller(each.source)}"


def _mostly(each: Requirement) -> str:
    return f"; most of it comes from {source_words.words(each.source)}" if each.source else ""


def _count(some: int, every: int) -> str:
    if every == 1:
        return "The requirement is"
    return f"all {every} requirements are" if some == every else f"{some} of {every} requirements {_are(some)}"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def _which(some: Sequence[Requirement], found: Sequence[Requirement]) -> str:
    """By name where they are few."""
    if len(some) > _NAMED or (len(some) == len(found) > 1):
        return _count(len(some), len(found))
    return f"{_named(some, found)} {_are(len(some))}"


def _named(some: Sequence[Requirement], found: Sequence[Requirement]) -> str:
    """Names with the numbers of their balloons, where there are several; of very many the numbers alone."""
    if len(some) > _NAMED:
        return f"requirements no. {_joined([str(each.number) for each in some])}"
    return _joined([f"{each.title} (no. {each.number})" if len(found) > 1 else each.title for each in some])


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
