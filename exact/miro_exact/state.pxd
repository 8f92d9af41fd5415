# C layout of miro_exact.state: none; compiled for its calls.
