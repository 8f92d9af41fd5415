"""The theory of Yang & Kim (IEEE T-RA 15(3), 1999) as functions: what the paper derives, for tests and along runs."""
