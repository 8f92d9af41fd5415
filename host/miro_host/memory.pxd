# C types of miro_host.memory.

cpdef check(str name, code, value)
cdef _check(str name, str code, value)
