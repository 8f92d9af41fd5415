"""Tracking laws: their names (`registry`), the interface (`interface`), and the laws themselves, one in each module."""
