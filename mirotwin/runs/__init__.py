"""One run: what is to be run (`spec`), the run under way (`run`), what came of it (`result`)."""
