cimport cython

cdef int _STOPS, _MODES, _ACCELERATION, _VELOCITY, _POSITION, _COMPLETED, _OUT_OF_RANGE
cdef long long _MASK_30


cpdef long long clamped(long long value, long long low, long long high) noexcept
cpdef long long signed_32(long long value) noexcept
cpdef long long signed_31(long long value) noexcept
cpdef int fit_15(int word, bint clamp) noexcept


@cython.final
cdef class TrajectoryBuffer:
    cdef public int due, half, control, relative_bits
    cdef public long long acceleration, velocity, position
    cdef public bint relative, newer_position
    cdef public int taken_control
    cdef public long long taken_acceleration, taken_velocity, taken_position
    cdef public bint taken_relative

    cpdef void reset(self) noexcept
    cpdef int begin(self, int control) noexcept
    cpdef int words_due(self) noexcept
    cpdef void refresh(self, long long acceleration, long long velocity, long long target) noexcept
    @cython.locals(high=cython.longlong, relative=cython.bint, fits=cython.bint)
    cpdef int word(self, int word, long long acceleration, long long velocity, bint clamp=*) noexcept
    cdef int _next_parameter(self) noexcept
    cpdef void abandon(self) noexcept
    cpdef void shift(self, long long real_position) noexcept
    cpdef void take(self, bint keep_stops=*) noexcept
    cpdef long long resolve(self, long long base) noexcept


@cython.final
cdef class FilterBuffer:
    cdef public int due, ds, taken_ds
    cdef readonly int coefficients[4]
    cdef int taken[4]

    cpdef void reset(self) noexcept
    cpdef int begin(self, int control) noexcept
    cpdef int words_due(self) noexcept
    cpdef int word(self, int word, bint clamp=*) noexcept
    cpdef void abandon(self) noexcept
    cpdef void take(self) noexcept
