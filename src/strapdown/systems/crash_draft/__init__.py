"""Propose a case file from records: found values, assumptions and open questions."""

from strapdown.systems.crash_draft.draft import Draft, draft_case, read_records

__all__ = ["Draft", "draft_case", "read_records"]
