"""Posture estimators: the interface, and ours: `none` (the paper's loop), `predict`, `ekf`."""
