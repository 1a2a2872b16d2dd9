"""The dossier of a scene: what a laboratory shows an assessor of the software that predicts its uncertainties."""

from validation.dossier.dossier import Dossier, Size, make

__all__ = ["Dossier", "Size", "make"]
