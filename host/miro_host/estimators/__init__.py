"""Posture estimators: names (`registry`), the interface, the paper's loop (`none`), and a predictor (`predict`)."""
