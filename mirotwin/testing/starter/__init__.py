"""What a user begins with: a sample project, and the examples of the pages. Their files are in `examples/`, or here."""
