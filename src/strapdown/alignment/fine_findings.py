"""What a person should know of a fine alignment."""

from __future__ import annotations

from strapdown.alignment.fine_result import FineResult
from strapdown.alignment.site import Site
from strapdown.exceptions import Finding


def fine_findings(result: FineResult, site: Site) -> tuple[Finding, ...]:
    """Say what does not hold, and what the sensors could not tell.

    Parameters
    ----------
    result : FineResult
    site : Site

    Returns
    -------
    tuple of Finding
    """
    return ()
