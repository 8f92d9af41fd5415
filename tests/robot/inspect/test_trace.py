"""A trace has a line for each step, with what it changed."""

from miro_robot.inspect.symbol_names import SymbolNames
from miro_robot.inspect.trace import REGISTERS, InstructionTrace, registers
from miro_robot.inspect.watcher import attach, detach
from tests.alone import Alone
from tests.robot.mcs51.asm import image_of
from tests.robot.mcs51.rig import cpu_with

PROGRAM = """
    LJMP main
    ORG 0Bh
    INC R7
    RETI
main:
    MOV A,#12h
    MOV DPTR,#1234h
    MOV R3,A
    LCALL sub
    MOV TMOD,#02h
    MOV TH0,#F0h
    MOV TL0,#F0h
    MOV IE,#82h
    SETB TR0
    ORL PCON,#01h
    SJMP $
sub:
    MOV R3,A
    RET
"""


def attached(text=PROGRAM, **options):
    """A CPU and the lines of the trace of what it will run."""
    cpu, lines = cpu_with(text), []
    attach(cpu, InstructionTrace(SymbolNames(image_of(text)), lines.append, **options))
    return cpu, lines


def traced(cycles, text=PROGRAM, **options):
    cpu, lines = attached(text, **options)
    cpu.run(cycles)
    return lines


def test_a_line_has_tick_address_place_instruction_and_changed_registers():
    assert traced(10)[:4] == [
        f"{0:>12}  0000  {'reset':<28}  LJMP 000Dh",
        f"{24:>12}  000D  {'000Dh':<28}  {'MOV A,#12h':<30}  A=12",
        f"{36:>12}  000F  {'000Dh+2':<28}  {'MOV DPTR,#1234h':<30}  DPTR=1234",
        f"{60:>12}  0012  {'000Dh+5':<28}  {'MOV R3,A':<30}  R3=12",
    ]


def test_a_register_written_with_what_it_held_has_not_changed():
    first, again = (line for line in traced(12) if "MOV R3,A" in line)
    assert first.endswith("R3=12")
    assert again.endswith("MOV R3,A")


def test_sleep_and_the_interrupt_that_ends_it_have_lines_of_their_own():
    lines = traced(60)
    asleep = next(index for index, line in enumerate(lines) if "-- asleep for" in line)
    assert "-- interrupt: timer 0, to vector timer 0" in lines[asleep + 1]
    assert "INC R7" in lines[asleep + 2]
    assert lines[asleep + 2].endswith("R7=01")


def test_sleep_is_one_line_however_the_run_is_cut():
    text, lines = "NOP\nMOV PCON,#01h\nSJMP $", []
    cpu = cpu_with(text)
    trace = InstructionTrace(SymbolNames(image_of(text)), lines.append, heading="heading")
    attach(cpu, trace)
    for cycle in (10, 20, 500):
        cpu.run(cycle)
    detach(cpu, trace)
    assert lines[0] == "heading"
    assert [line.split("-- ")[1] for line in lines if "--" in line] == ["asleep for 497 cycles"]


def test_a_program_that_changes_its_own_operands_is_shown_as_it_was_executed():
    image, lines = image_of("MOV DPTR,#0005h\nNOP\nMOV A,#00h\nINC A\nMOVX @DPTR,A\nSJMP 0004h"), []
    machine = Alone(image, code_in_xram=True)
    attach(machine.cpu, InstructionTrace(SymbolNames(image), lines.append))
    machine.run(max_cycles=30)
    shown = [line.split("MOV A,")[1].split()[0] for line in lines if "MOV A," in line]
    assert shown == ["#00h", "#01h", "#02h", "#03h", "#04h"]


def test_only_the_functions_asked_for_are_written():
    whole = traced(60)
    main = next(int(line.split()[1], 16) for line in whole if "MOV A,#12h" in line)
    only = traced(60, only={main})
    assert only
    assert [line for line in whole if f"  {main:04X}h" in line and "--" not in line] == [
        line for line in only if "--" not in line
    ]


def test_the_changed_registers_lead_from_the_first_state_to_the_last():
    cpu, lines = attached()
    state = dict(zip(REGISTERS, registers(cpu), strict=True))
    cpu.run(24)  # before the first interrupt, which pushes
    for line in lines:
        for change in line[78:].split():
            name, _, value = change.partition("=")
            state[name] = int(value, 16)
    assert state == dict(zip(REGISTERS, registers(cpu), strict=True))


def test_of_a_program_that_changes_itself_only_so_many_instructions_are_remembered(monkeypatch):
    expected = traced(200)
    monkeypatch.setattr("miro_robot.inspect.trace._STATIC_KEPT", 2)
    assert traced(200) == expected


def test_ports_show_the_pins_that_changed():
    lines = traced(8, "CLR P1.3\nMOV P1,#5Ah\nMOV P1,#5Ah\nSETB P1.0\nMOV P2,#0Fh\nNOP")
    assert [line[82:] for line in lines] == ["P1.3=0", "P1=5A", "", "P1.0=1", "P2=0F"]
