cimport cython
from libc cimport math
from miro_exact cimport dmath
from miro_exact.rng cimport Stream
from miro_sim.plant.chassis cimport Body

cdef double TURN, TICKS_PER_S, TICK_S, PWM_TICKS, ALL_GRIP_N, NEAR, _ANGLES
cdef int SWEEPS, NEWTON_STEPS

@cython.final
cdef class DisturbingForce:
    cdef readonly Stream stream
    cdef readonly long long period_ticks
    cdef readonly double constant_n, constant_nm, sine_n, sine_nm, noise_n, noise_nm
    cdef readonly bint is_on, varies
    cdef readonly double force_n, torque_nm

    cpdef void at(self, long long tick) except *


@cython.final
cdef class RoughBody(Body):
    cdef readonly DisturbingForce forces
    cdef readonly double half_track_m, stiction_ratio, load_friction, play_m, rolling_n, grip_n, ball_n, ball_m
    cdef readonly double mass_kg, yaw_kg_m2, rotor_kg_m2, hub_per_kg, ball_x_per_kg, ball_y_per_kg
    cdef public double v_m_s, u_m_s, w_rad_s
    cdef readonly double left_force_n, right_force_n, left_load_n, right_load_n
    cdef readonly double left_play_m, right_play_m
    cdef double _rub_nms, _push_ns, _ball_x_ns, _ball_y_ns, _ball_z
    cdef readonly double forward_m[16], leftward_m[16], turned_rad[16]

    cpdef bint stands(self) noexcept
    cdef bint _roll_on(self, double left_nms, double right_nms, double most_left, double most_right, double more_v,
                       double more_w, double aside, double step_s) noexcept
    cdef void _resist(self, double lever_m, double step_s) noexcept
    cdef void _turn_frame(self, double tangent) noexcept
    @cython.locals(left_stands=cython.bint, right_stands=cython.bint, left_held=cython.bint, changed=double)
    cdef void _dissipate(self, double most_left, double most_right, double step_s) noexcept
    cdef inline double _most_back_n(self, double play_m) noexcept
    cdef inline double _most_ahead_n(self, double play_m) noexcept
    cdef inline double _grip_left_n(self, double along_n) noexcept
    cdef inline void _move(self, double push_ns, double lever_m) noexcept
    cdef void _wheel(self, double hub, double shaft, double roll, double rub, double push, double most,
                     double back, double ahead) noexcept
    cdef double _drag(self, double most) noexcept
