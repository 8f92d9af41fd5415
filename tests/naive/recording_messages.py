"""The messages of a control period one by one, each as the struct that a reader makes of it."""

import msgspec

from miro_host.eye.track import Sighting
from mirotwin.recording import channels as ch


def messages(period):
    """(topic, tick, message as JSON) of everything in a period, in the order of a recording."""
    found = []
    for robot in period.robots:
        for name, message in of_robot(robot, period.tick):
            found.append((ch.topic_name(name, robot.network, robot.slot), period.tick, message))
    for sent in period.wire:
        message = ch.WireMessage(sent.tick, sent.direction, sent.data.hex(), sent.bad_stop)
        found.append((ch.topic_name(ch.WIRE, sent.network), sent.tick, message))
    for action in period.actions:
        channel, about = ch.action_message(action)
        found.append((ch.topic_name(channel, action.network), action.tick, about))
    found.append((ch.PERIOD, period.tick, ch.PeriodMessage(period.tick, period.index, period.digest)))
    return [(topic, tick, msgspec.json.encode(message)) for topic, tick, message in found]


def of_robot(robot, tick):
    at, true, seen, control = robot.reference, robot.truth, robot.measurement, robot.control
    yield "reference", ch.PostureMessage(tick, at.x_m, at.y_m, at.theta_rad)
    yield "truth", ch.TruthMessage(tick, true.x_m, true.y_m, true.theta_rad, robot.v_m_s, robot.w_rad_s)
    if seen is not None:
        of_picture = (seen.tick, seen.confidence) if isinstance(seen, Sighting) else (None, None)
        yield "measurement", ch.MeasurementMessage(tick, seen.x_m, seen.y_m, seen.theta_rad, *of_picture)
    if control is not None:
        values = control.v_m_s, control.w_rad_s, control.left, control.right, control.inner, control.estimate
        yield "control", ch.ControlMessage(tick, *values)
    if None not in (robot.accepted, robot.rejected, robot.stale):
        yield "firmware", ch.FirmwareMessage(tick, robot.accepted, robot.rejected, robot.stale)
    yield "lm629", ch.Lm629Message(tick, registers(robot.left), registers(robot.right))
    yield "pwm", ch.PwmMessage(tick, duty(robot.left), duty(robot.right))


def registers(axis):
    values = axis.desired_position, axis.real_position, axis.desired_velocity, axis.status
    return ch.RegistersMessage(*values, tuple(ch.CommandMessage(*command) for command in axis.commands))


def duty(axis):
    return ch.DutyMessage(axis.pwm_sign, axis.pwm_magnitude)
