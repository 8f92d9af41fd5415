"""A debugger that goes backwards: a run as a timeline, its firmware by lines and names, a console and an adapter."""
