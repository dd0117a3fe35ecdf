"""Whole commands under faults: killed, failing at a system call, and two at once."""
