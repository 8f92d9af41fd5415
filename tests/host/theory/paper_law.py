"""The paper's law, asked for all that it works out."""

from miro_host.laws import yang_kim


class YangKim(yang_kim.YangKim):
    def control(self, reference, measured, v_m_s, w_rad_s):
        """Errors, surfaces and inputs, in a `YangKimControl` of their own."""
        control = yang_kim.YangKimControl(self.parameters)
        control.work_out(reference, measured, v_m_s, w_rad_s)
        return control
