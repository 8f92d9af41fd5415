"""The `mirotwin` program: where it starts (`entry`). Nothing else is imported here, so that it starts at once."""
