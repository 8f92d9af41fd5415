"""Verification of a run or a firmware: checks, steps, cases, conformance."""
