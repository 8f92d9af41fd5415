"""The pitch: its size and axes, and whether a robot fits."""
