"""Campaigns: many cases of one question, and what they say together."""
