cimport cython

cdef long long _FOLLOWS_FROM, _FOLLOWS_TO, SPACING_TICKS, SPACING_TOLERANCE_TICKS


@cython.locals(byte=int, stop_good=cython.bint, tick='long long', start_tick='long long', last_tick='long long',
               tolerance_ticks='long long')
cpdef list of_symbols(symbols, direction, network=*, long long spacing_ticks=*)
