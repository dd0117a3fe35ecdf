"""What rests on recordings and curves that are not there."""

from __future__ import annotations

from papers.reproduction import CANNOT_BE_JUDGED, Evidence, Statement

FIGURES = (4, 11)


def unpublished() -> list[Statement]:
    """Return them."""
    return [
        Statement(
            "curves",
            "Section 4, Figs. 4-11",
            "Certain of the results of a testbed experiment on the estimation of accuracy "
            "characteristics of the SINS 1000 system are shown in Figs.4-7.",
            CANNOT_BE_JUDGED,
            "",
            "The curves did not survive scanning and the text gives none of their numbers: no "
            "error, no drift, no duration. The recordings were not published.",
            (Evidence("figures without a number", float(FIGURES[1] - FIGURES[0] + 1)),),
        ),
        Statement(
            "made-to-order",
            "Section 4",
            "The studies conducted have corroborated the fact that it is effective to apply the "
            "object-oriented technology to the creation of SINSs which can be made to order.",
            CANNOT_BE_JUDGED,
            "",
            "No other way of creating one was tried, and no effort is stated.",
            (Evidence("systems compared", 1.0),),
        ),
    ]
