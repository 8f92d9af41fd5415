"""Tracking laws: the interface (`interface`), and the laws themselves, one in each module."""
