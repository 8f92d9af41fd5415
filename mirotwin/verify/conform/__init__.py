"""Conformance: the protocol page as numbered rules, each of which any firmware can be tried against."""
