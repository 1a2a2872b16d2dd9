"""What standards ask of software that tells an uncertainty by simulation, in our own words, and where it is answered.

ISO/IEC 17025:2017 by its clauses. The text of ISO/TS 15530-4:2008 is not public: it is named by the subjects of its
published abstract, without clauses.
"""

from __future__ import annotations

from dataclasses import dataclass

LABORATORY, SIMULATION = "ISO/IEC 17025:2017", "ISO/TS 15530-4:2008"


@dataclass(frozen=True)
class Asked:
    """A clause, or a subject, of a standard: what it asks in our own words, the headings (by key) that answer it, and
    what is the laboratory's own to do."""

    standard: str
    clause: str
    asks: str
    headings: tuple[str, ...]
    laboratory: str = ""


ASKED = (
    Asked(LABORATORY, "7.6", "Find all that contributes to the uncertainty, and evaluate it.", ("budget", "limits"),
          "see that the scene states all of its station's contributions"),
    Asked(LABORATORY, "7.8.6", "Say by which rule conformity is decided, and the risk of it.", ("task",),
          "agree on the rule with the customer"),
    Asked(LABORATORY, "7.11.1", "Have the data and information that the work needs.", ("identity",)),
    Asked(LABORATORY, "7.11.2", "Validate software before it is used, its interfaces, too; authorise, document and "
          "validate every change.", ("agreement", "alarms", "controls", "coverage", "hard", "repeat"),
          "authorise its use; make the dossier anew after each change of version, scene or part file"),
    Asked(LABORATORY, "7.11.3 a", "Protect it from unauthorised access.", (), "access to machine and files"),
    Asked(LABORATORY, "7.11.3 b", "Safeguard it against tampering and loss.", ("identity", "repeat"),
          "keep the folder; check it by its SHA256SUMS"),
    Asked(LABORATORY, "7.11.3 c", "Run it in an environment that it is made for.", ("identity",),
          "install the versions that are listed"),
    Asked(LABORATORY, "7.11.3 d", "Maintain it so that data stay whole.", ("identity", "repeat")),
    Asked(LABORATORY, "7.11.3 e", "Record failures, and what was done about them.", ("agreement",),
          "keep the log file that a failure names; exit status 3 is an error of the program"),
    Asked(LABORATORY, "7.11.4", "See that providers from outside keep these requirements.", (), "if there are any"),
    Asked(LABORATORY, "7.11.5", "Have instructions, manuals and reference data at hand.", ("repeat",),
          "keep the documentation of the version that is listed"),
    Asked(LABORATORY, "7.11.6", "Check calculations and transfers of data systematically.",
          ("hard", "controls", "identity")),
    Asked(SIMULATION, "influences", "Declare which influences the software takes into account (device, environment, "
          "strategy, object), how each is stated, and which it leaves out.", ("budget", "limits")),
    Asked(SIMULATION, "technique", "Describe how the simulation makes an uncertainty of them.", ("budget", "coverage")),
    Asked(SIMULATION, "range of use", "State for which tasks it is valid.", ("task", "limits")),
    Asked(SIMULATION, "tests by simulation", "Test stated uncertainties on stations whose errors are known, because "
          "they are simulated.", ("coverage", "agreement")),
    Asked(SIMULATION, "tests by reference", "Compare results with references of another origin.", ("hard",)),
    Asked(SIMULATION, "tests by measuring", "Measure calibrated parts, and compare errors with stated uncertainties.",
          (), "measure a calibrated part at the station; nothing here replaces it"),
    Asked(SIMULATION, "documentation", "Hand over what the user needs to judge and repeat it.", ("identity", "repeat")),
)  # fmt: skip
