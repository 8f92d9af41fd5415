"""One run: its specification (`spec`), the running world (`run`), and its result (`result`)."""
