"""The same chain at the pace of a clock: a record played to it, or samples as they come."""
