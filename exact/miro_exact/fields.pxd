# C layout of miro_exact.fields.

cdef class Items:
    cdef readonly object form, code, room, bounds, ordered, made
