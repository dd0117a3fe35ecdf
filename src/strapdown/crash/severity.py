"""Published models of injury risk.

Only models with an identified published table are included. URGENCY and its successors
(Malliaris 1997, Bahouth 2004, Kononen 2011) and the MAIS3+ model of the planner by Geisslinger
and others (2023) are not: their coefficients were found in programs that name no table of a
publication. `severity_file.load_severity_model` reads them from a user who has the source.
"""

from __future__ import annotations

from strapdown.crash.severity_model import SeverityModel, Term
from strapdown.errors import ConfigError

__all__ = ["SEVERITY_MODELS", "find_severity_model"]

WANG_NOTE = (
    "Logistic regression on NASS-CDS 2010-2015, all occupants together, belted or not. The report "
    "itself was not at hand: the coefficients are as two public programs quote them, which name "
    "the tables, A-3 of all crashes and A-6 of frontal ones (also as 4-1 and 4-3). The range given "
    "is that in which the curves of one table keep their order (a graver injury is less likely), "
    "and not the report's own. Its tables of other directions were not seen."
)
# First crossing of two curves of a table, in mph, rounded down: 56.3 and 60.4.
WANG_RANGE = {"all": 56.0, "front": 60.0}
WANG_TABLE = {"all": "A-3", "front": "A-6"}


def _wang(crash: str, outcome: str, intercept: float, slope: float) -> SeverityModel:
    return SeverityModel(
        name=f"wang_2022_{crash}_{outcome.lower().replace('+', '')}",
        title="MAIS(05/08) injury probability curves as functions of delta V, DOT HS 813 219",
        author="Wang",
        year=2022,
        table=f"Table {WANG_TABLE[crash]}",
        outcome=outcome,
        intercept=intercept,
        terms=(Term("delta_v", slope, "mph"),),
        validity={"delta_v": (0.0, WANG_RANGE[crash])},
        applies={} if crash == "all" else {"crash_type": (crash,)},
        note=WANG_NOTE,
    )


#: Models by name, as selected by the user.
SEVERITY_MODELS: dict[str, SeverityModel] = {
    "wang_2022_all_mais1": _wang("all", "MAIS1+", -1.3925, 0.0815),
    "wang_2022_all_mais2": _wang("all", "MAIS2+", -5.1331, 0.1479),
    "wang_2022_all_mais3": _wang("all", "MAIS3+", -6.9540, 0.1637),
    "wang_2022_all_mais4": _wang("all", "MAIS4+", -8.2070, 0.1564),
    "wang_2022_all_mais5": _wang("all", "MAIS5+", -8.7927, 0.1598),
    "wang_2022_all_fatal": _wang("all", "fatal", -8.9819, 0.1603),
    "wang_2022_front_mais1": _wang("front", "MAIS1+", -1.4930, 0.0854),
    "wang_2022_front_mais2": _wang("front", "MAIS2+", -4.9429, 0.1425),
    "wang_2022_front_mais3": _wang("front", "MAIS3+", -6.9774, 0.1620),
    "wang_2022_front_mais4": _wang("front", "MAIS4+", -8.4254, 0.1586),
    "wang_2022_front_mais5": _wang("front", "MAIS5+", -8.8355, 0.1566),
    "wang_2022_front_fatal": _wang("front", "fatal", -9.0422, 0.1571),
}


def find_severity_model(name: str) -> SeverityModel:
    """Return a model by its name.

    Raises
    ------
    ConfigError
        There is none of that name; the message suggests the nearest.
    """
    if name not in SEVERITY_MODELS:
        raise ConfigError(
            "crash.no-severity-model",
            quantity="severity model",
            name=name,
            word=name,
            known=SEVERITY_MODELS,
        )
    return SEVERITY_MODELS[name]
