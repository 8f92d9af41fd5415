"""A run as Foxglove shows it: derived topics in Foxglove's own schemas."""
