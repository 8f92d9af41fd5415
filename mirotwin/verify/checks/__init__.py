"""Checks: what is expected of a run, as components with names."""

OWN = {
    "no_fault": "mirotwin.verify.checks.faults:NoFault",
    "lm629_protocol": "mirotwin.verify.checks.faults:Lm629Protocol",
    "main_loop_alive": "mirotwin.verify.checks.faults:MainLoopAlive",
    "stack_clear": "mirotwin.verify.checks.faults:StackClear",
    "acts_at_all": "mirotwin.verify.checks.alive:ActsAtAll",
    "failsafe_stop_ms": "mirotwin.verify.checks.failsafe:FailsafeStop",
    "motors_off_ms": "mirotwin.verify.checks.failsafe:MotorsOff",
    "moves_only_when_fresh": "mirotwin.verify.checks.reception:MovesOnlyWhenFresh",
    "accepts_only_sent": "mirotwin.verify.checks.reception:AcceptsOnlySent",
    "acts_within_ms": "mirotwin.verify.checks.reception:ActsWithin",
    "back_in_sync_within_ms": "mirotwin.verify.checks.reception:BackInSync",
    "frames_accepted_min": "mirotwin.verify.checks.reception:FramesAccepted",
    "answers_within_ms": "mirotwin.verify.checks.answers:AnswersWithin",
    "answers_only_in_turn": "mirotwin.verify.checks.answers:AnswersOnlyInTurn",
    "happens": "mirotwin.verify.checks.happens:Happens",
    "never_happens": "mirotwin.verify.checks.happens:NeverHappens",
    "wheels_within_m_s": "mirotwin.verify.checks.wheels:WheelsWithin",
    "tracks_within_cm": "mirotwin.verify.checks.course:TracksWithin",
    "settles_within_s": "mirotwin.verify.checks.course:SettlesWithin",
    "inside_pitch": "mirotwin.verify.checks.course:InsidePitch",
    "never_sleeps": "mirotwin.verify.checks.serial:NeverSleeps",
}
"""Our own checks: name -> `module:class`. A room above that brings a check adds it here; this file imports nothing."""
