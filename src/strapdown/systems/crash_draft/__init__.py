"""A case file drafted from records: found, assumed, and left to the user."""

from strapdown.systems.crash_draft.draft import Draft, draft_case, read_records

__all__ = ["Draft", "draft_case", "read_records"]
