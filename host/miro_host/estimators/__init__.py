"""Posture estimators: names (`registry`), the interface, and ours: `none` (the paper's loop), `predict`, `ekf`."""
