"""The names of the checks.

What belongs here: the table of our own checks, and which are always on. What does not: the interface (`interface`) and
the checks. No check is imported before it is named.
"""

from miro_host.parts import Registry

ALWAYS_ON = ("no_fault", "lm629_protocol", "main_loop_alive", "stack_clear", "acts_at_all")

CHECKS: Registry[object] = Registry(
    "mirotwin.checks",
    word="check",
    key="check",
    base="mirotwin.checks.interface:Check",
    own={
        "no_fault": "mirotwin.checks.faults:NoFault",
        "lm629_protocol": "mirotwin.checks.faults:Lm629Protocol",
        "main_loop_alive": "mirotwin.checks.faults:MainLoopAlive",
        "stack_clear": "mirotwin.checks.faults:StackClear",
        "acts_at_all": "mirotwin.checks.alive:ActsAtAll",
        "failsafe_stop_ms": "mirotwin.checks.failsafe:FailsafeStop",
        "motors_off_ms": "mirotwin.checks.failsafe:MotorsOff",
        "moves_only_when_fresh": "mirotwin.checks.reception:MovesOnlyWhenFresh",
        "accepts_only_sent": "mirotwin.checks.reception:AcceptsOnlySent",
        "acts_within_ms": "mirotwin.checks.reception:ActsWithin",
        "back_in_sync_within_ms": "mirotwin.checks.reception:BackInSync",
        "frames_accepted_min": "mirotwin.checks.reception:FramesAccepted",
        "answers_within_ms": "mirotwin.checks.answers:AnswersWithin",
        "answers_only_in_turn": "mirotwin.checks.answers:AnswersOnlyInTurn",
        "happens": "mirotwin.checks.happens:Happens",
        "never_happens": "mirotwin.checks.happens:NeverHappens",
        "wheels_within_m_s": "mirotwin.checks.wheels:WheelsWithin",
        "tracks_within_cm": "mirotwin.checks.course:TracksWithin",
        "settles_within_s": "mirotwin.checks.course:SettlesWithin",
        "inside_pitch": "mirotwin.checks.course:InsidePitch",
        "conforms_to": "mirotwin.conform.judgement:ConformsTo",
    },
)
