# C layout of miro_exact.fields.

cdef class Kind:
    pass


cdef class Items(Kind):
    cdef readonly object form, code, room, bounds, ordered, made
    cdef public object packed
