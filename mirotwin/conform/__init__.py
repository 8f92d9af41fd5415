"""Conformance: the protocol page as numbered rules, each of which any firmware can be tried against."""

from mirotwin.verify.checks import OWN

OWN["conforms_to"] = f"{__name__}.rule_monitor:ConformsTo"
