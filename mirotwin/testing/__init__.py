"""For people's own tests: the robot's firmware on a bench behind the radio, and Hypothesis to look for trouble.

What belongs here: `bench` (host, radio, robot, and the Python decoder beside it), `noisy_wire` (what goes wrong between
them), `profiles` (strategies of radios), `machine` (a `RuleBasedStateMachine`). What does not: expectations about
one's own robot. `profiles` and `machine` need the extra `strategies`.

    from mirotwin.testing.machine import LinkMachine

    class TestMyFirmware(LinkMachine.TestCase):
        pass
"""
