"""A case file drafted from records: found, assumed, and left to the user."""

from strapdown.systems.crash_draft.draft import Draft
from strapdown.systems.crash_draft.from_records import draft_case, read_records

__all__ = ["Draft", "draft_case", "read_records"]
