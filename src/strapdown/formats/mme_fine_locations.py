"""Fine locations of ISO MME channel codes in words, as far as they tell of a crash.

Codes and meanings are those of RED B 1.6.2 of ISO/TS 13499 (2020), in our words.
"""

from __future__ import annotations

__all__ = ["FINE", "FINE_1", "FINE_2", "FINE_3"]

#: In any of the three, with one meaning.
FINE: dict[str, str] = {
    "00": "",
    "BO": "bottom",
    "FR": "front",
    "IN": "inner",
    "LE": "left",
    "LO": "lower",
    "MI": "middle",
    "OU": "outer",
    "RE": "rear",
    "RI": "right",
    "TP": "top",
    "UP": "upper",
    "CG": "centre of gravity",
    "CX": "centre in x",
    "CY": "centre in y",
    "CZ": "centre in z",
    "PR": "before the test",
    "RD": "redundant",
    **{f"{k:02d}": f"no. {k}" for k in range(1, 100)},
}
#: In the first.
FINE_1: dict[str, str] = {
    "AV": "mean",
    "SU": "sum",
    "LL": "left lower",
    "LR": "left and right",
    "LU": "left upper",
    "RL": "right lower",
    "RU": "right upper",
    "LA": "left anterior",
    "LM": "left middle",
    "LP": "left posterior",
    "RA": "right anterior",
    "RM": "right middle",
    "RP": "right posterior",
    "CS": "crash sensor",
    "IS": "impact sound sensor",
    "OR": "origin",
    "AD": "adult",
    "CH": "child",
    "IP": "in position",
    "OP": "out of position",
}
#: In the second.
FINE_2: dict[str, str] = {
    "AV": "mean",
    "SU": "sum",
    "DI": "difference",
    "NE": "negative",
    "PO": "positive",
    "SF": "scale factor",
    "L1": "left redundant",
    "L2": "lower redundant",
    "M1": "middle redundant",
    "R1": "right redundant",
    "U1": "upper redundant",
    "HS": "high-speed sampling",
    "RW": "raw data",
    "OR": "origin",
    "3C": "3 ms value, cumulative",
    "3S": "3 ms value, single peak",
}
#: In the third: dummies.
FINE_3: dict[str, str] = {
    "PO": "after the test",
    "BR": "BioRID",
    "BS": "BioSID",
    "E1": "EuroSID-1",
    "E2": "ES-2",
    "ER": "ES-2 with rib extension",
    "H2": "Hybrid II, mid-sized male",
    "H3": "Hybrid III, mid-sized male",
    "HF": "Hybrid III, small female",
    "HM": "Hybrid III, large male",
    "Q0": "Q0 dummy",
    "Q1": "Q1 dummy",
    "Q2": "Q1.5 dummy",
    "Q3": "Q3 dummy",
    "Q4": "Q3 dummy for side impact",
    "Q6": "Q6 dummy",
    "QA": "Q10 dummy",
    "QB": "Q10 dummy (Euro NCAP)",
    "S2": "SID-IIs",
    "SH": "SID-H3",
    "SI": "SID",
    "TF": "THOR, small female",
    "TH": "THOR",
    "TM": "THOR, large male",
    "T3": "THOR with Hybrid III legs",
    "WF": "WorldSID, small female",
    "WS": "WorldSID",
    "Y6": "Hybrid III, 3 years",
    "Y7": "Hybrid III, 6 years",
    "YA": "Hybrid III, 10 years",
}
