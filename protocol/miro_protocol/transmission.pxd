cimport cython

cdef long long _FOLLOWS_FROM, _FOLLOWS_TO


@cython.locals(byte=int, stop_good=cython.bint, tick='long long', start_tick='long long', last_tick='long long')
cpdef list of_symbols(symbols, direction, network=*)
