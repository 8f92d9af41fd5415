cpdef check(str name, code, value)
cdef _check(str name, str code, value)
