"""Fuzzing firmware: inputs that find what it must not do, guided by what it executes.

What belongs here: targets, engines, what is made of a find. What does not: the compiled machine that runs an input
(`miro_robot.harness`), and the checks that have the last word (`mirotwin.verify.checks`).
"""
