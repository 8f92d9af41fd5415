"""All numbers of a reference, in the order of the twins."""


def numbers(r):
    return (
        *(r.posture.x_m, r.posture.y_m, r.posture.theta_rad, r.v_m_s, r.w_rad_s, r.v_dot_m_s2),
        *(r.w_dot_rad_s2, r.rho_m, r.phi_rad, r.rho_rate_m_s, r.phi_rate_rad_s, r.rho_accel_m_s2),
    )
