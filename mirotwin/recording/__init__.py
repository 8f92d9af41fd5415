"""Recordings: a run as an MCAP file, its channels, and reading it back."""
