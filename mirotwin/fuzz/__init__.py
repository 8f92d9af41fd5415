"""Fuzzing firmware: inputs that make it do what it must not, guided by what it executes.

What belongs here: targets, engines, what is made of a crash. What does not: the compiled machine that runs an input
(`miro_robot.harness`), and the checks that have the last word (`mirotwin.verify.checks`).
"""
