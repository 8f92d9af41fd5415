"""Checks: what is expected of a run, as components with names."""
