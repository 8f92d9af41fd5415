"""Fuzzes firmware: searches for inputs that make it fail, guided by its coverage.

This package contains targets, engines and the triage of crashes. It does not contain the compiled machine that runs an
input (`miro_robot.harness`), nor the checks that confirm a failure (`mirotwin.verify.checks`).
"""
