cimport cython

cdef long long NEVER_TICK, _HALF_SPACE, _SPACE_MASK

cdef long long _wrapped(long long position) noexcept

cdef long long _stopping_distance(long long speed, long long acceleration) noexcept


@cython.final
cdef class ProfileGenerator:
    cdef readonly int keeps_fraction
    cdef public long long position, velocity, acceleration, max_velocity, target
    cdef public int velocity_mode, forward, stopping, moving, crossed

    cpdef void reset(self) noexcept
    cpdef void start(self, int stopping=*) noexcept
    cpdef void stop_abruptly(self, long long place) noexcept
    cpdef void follow(self, long long real_position) noexcept
    cpdef void define_home(self, long long real_position) noexcept
    cpdef int step(self) noexcept
    cdef int _slow_to_rest(self) noexcept
    cdef void _approach(self, long long goal) noexcept
    @cython.locals(backwards=cython.int)
    cdef int _towards_target(self) noexcept
    cdef long long _speed(self, long long v, long long distance) noexcept
    cdef void _move(self, long long velocity) noexcept
