"""How many images each setting of a run is to have, asked for in one stage or several, as numbered chunks."""

from __future__ import annotations

from collections.abc import Sequence

from validation.batch.work import CHUNK


class Stages:
    """Images wanted of each setting, stage by stage; a later stage adds chunks and changes none before it.

    Parameters
    ----------
    wanted : list of sequence of int
        Images of each setting in all, after the first stage, the second, ...
    settings : sequence of int, optional
        Which of them are worked on; all when not given.

    Attributes
    ----------
    total : int
        Images of the settings that are worked on.
    """

    def __init__(self, wanted: list[Sequence[int]], settings: Sequence[int] | None = None) -> None:
        self._wanted = [[int(n) for n in stage] for stage in wanted]
        self._settings = range(len(wanted[0])) if settings is None else settings
        self.total = self._sum()

    @property
    def later(self) -> list[list[int]]:
        """All stages but the first."""
        return self._wanted[1:]

    def extend(self, wanted: Sequence[int]) -> bool:
        """Add a stage; False, and nothing is added, if no setting gets more images than it has."""
        grown = [max(int(new), old) for new, old in zip(wanted, self._wanted[-1], strict=True)]
        if grown == self._wanted[-1]:
            return False
        self._wanted.append(grown)
        self.total = self._sum()
        return True

    def _sum(self) -> int:
        return sum(self._wanted[-1][setting] for setting in self._settings)

    def sizes(self, index: int) -> dict[int, int]:
        """Images of each chunk of a setting.

        Examples
        --------
        >>> Stages([[300], [400]]).sizes(0)
        {0: 250, 1: 50, 2: 100}
        """
        found: list[int] = []
        for stage in self._wanted:
            extra = stage[index] - sum(found)
            found += [min(CHUNK, extra - first) for first in range(0, extra, CHUNK)]
        return dict(enumerate(found))
