# C layout of miro_exact.state.

cdef class One:
    cdef readonly object field, part, name, kind, value, sibling
