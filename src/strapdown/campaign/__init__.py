"""Campaigns: many cases of one configuration, or one for each log, and what they say together."""
