"""Replay: the script of a recording or stream, and where a robot answers otherwise."""
