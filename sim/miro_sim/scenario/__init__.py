"""The scenario: which keys a file may have, reading one, and what is wrong with it; built-in ones in `builtin/`."""
