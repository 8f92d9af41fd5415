"""Tracking laws: their names (`registry`), the interface (`interface`), and the paper's law (`yang_kim`)."""
