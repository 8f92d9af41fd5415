"""The paper's theory in the whole loop: what its disturbance is made of, and what breaks its assumptions.

More runs and seeds: `python -m tests.sim.theory_in_the_loop`.
"""

from tests.sim.theory_in_the_loop import run


def test_most_of_f1_is_the_dead_time_of_about_one_period():
    """Compared with the motion one period later, f1 is less than half."""
    theory, late = run("fig8", 3)
    assert late[0] < 0.5 * theory.disturbance.f1_rms_m_s2


def test_condition_17_is_broken_in_many_frames_of_fig_8_and_the_robot_gets_there_all_the_same():
    theory, _ = run("fig8", 3)
    assert 0.1 < theory.disturbance.f1_above_p1 < 0.9
    assert theory.disturbance.f1_largest_m_s2 > 2.0 * theory.disturbance.p1_m_s2


def test_on_the_line_of_fig_6_f1_is_below_p1_but_above_what_the_layer_leaves_of_it_in_most_frames():
    """The robot never leaves the layer of s1, which is 0.4 m/s wide."""
    f, _ = run("fig6", 3)
    assert f.disturbance.f1_above_p1 < 0.1
    assert f.disturbance.f1_above_authority > 0.5


def test_sign_functions_chatter_more_than_the_boundary_layers_of_remark_2():
    signs, layers = (run(name, 3)[0] for name in ("fig6, sign functions", "fig6"))
    assert signs.chattering_m_s2 > 2.5 * layers.chattering_m_s2


def test_from_the_start_of_fig_7_the_robot_passes_the_heading_that_assumption_3_forbids_and_drives_backward():
    """The paper's robot went forward and backward there too."""
    theory, _ = run("fig7", 3)
    assert theory.assumption_3.crossings % 2 == 1
    assert theory.reversals >= 1
    assert 0.1 < theory.backward_s < 2.0


def test_the_line_of_fig_6_keeps_all_three_assumptions():
    theory, _ = run("fig6", 3)
    for assumption in (theory.assumption_1, theory.assumption_2, theory.assumption_3):
        assert assumption.broken_s == 0.0
