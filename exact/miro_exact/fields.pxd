# C layout of miro_exact.fields: none; compiled for its calls.
