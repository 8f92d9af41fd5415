"""Shared code of all commands: options, exit codes, the screen, and files that are written completely or not at all."""
