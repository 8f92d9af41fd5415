"""Reports of a run for people: pages, tables, figures, exports."""
