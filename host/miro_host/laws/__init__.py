"""Tracking laws: the interface (`interface`), what a law remembers (`memory`), and the paper's law (`yang_kim`)."""
