"""A run as Foxglove shows it: derived topics in Foxglove's own schemas, in a file or while the run goes."""
