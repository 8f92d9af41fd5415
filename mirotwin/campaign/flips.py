"""Bit flips in RAM: a factor of a campaign (`--flips`), and the effect of each flip, by variable.

A flip is compared with the run of the same seed and levels without one. No effect: the state was the same at the end of
every control period. Lies there: all figures are the same, the flipped value was never read. Within 1 mm: the root
mean square of the position's error in the last second.
"""

from __future__ import annotations

from collections import Counter

from msgspec.structs import replace
from rich.table import Table

from miro_exact.bad_input import BadInput
from miro_exact.rng import Stream
from miro_robot.image import Image
from miro_robot.image.variables import variables_of
from mirotwin.campaign.columns import FIGURES
from mirotwin.campaign.design import Factor, Level
from mirotwin.campaign.plan import Plan, checked
from mirotwin.campaign.rows import SHARES, ResultRows
from mirotwin.campaign.single import image_of, prepared
from mirotwin.shell.console import plain_table
from mirotwin.verify.effect import NO_EFFECT

FLIP, NONE = "flip", "none"
REGISTERS, ELSEWHERE = "(registers)", "(stack, unused)"
FIRST_BIT, BITS = 0x20 * 8, 0x100 * 8
FIRST_MS = 5.0
"""Firmware boots before that."""
CLASSES = ("no effect", "lies there", "within 1 mm", "moves otherwise", *SHARES)
NEAR_CM = 0.1
_POSITION = "rms_position_cm"


def flipped(plan: Plan, count: int) -> Plan:
    """The plan with `count` flips, beside runs without: bit and time are functions of the number. Raises BadInput."""
    work = plan.work(0)
    text, _, steps = prepared(work.origin, work.text, work.settings)
    if steps:
        raise BadInput(plan.path, "--flips", "the scenario has steps", "write the fault into them")
    last_ms = 1000.0 * text.scenario.end_tick / text.scenario.clock - FIRST_MS
    names = variable_names(image_of(work.firmware))
    bits, times = Stream(0, "campaign flips/bits"), Stream(0, "campaign flips/times")
    levels = [Level(NONE)]
    for number in range(count):
        bit = int(BITS * bits.uniform(number))
        at_ms = round(FIRST_MS + (last_ms - FIRST_MS) * times.uniform(number), 3)
        where = f"{bit >> 3:02X}h.{bit & 7}"
        step = f'step=[{{pause_ms={at_ms}}}, {{fault="flip {where}"}}]'
        levels.append(
            Level(
                f"{names.get(bit >> 3, REGISTERS if bit < FIRST_BIT else ELSEWHERE)} {where} at {at_ms} ms",
                (step,),
                place="--flips",
            )
        )
    design = replace(plan.design, factors=(*plan.design.factors, Factor(FLIP, tuple(levels))))
    return checked(replace(plan, design=design))


def variable_names(image: Image) -> dict[int, str]:
    """Address in internal RAM -> variable, of the debug file beside the image."""
    names: dict[int, str] = {}
    for variables in variables_of(image).by_name.values():
        for variable in variables:
            if variable.space == "iram":
                name = f"{variable.scope}:{variable.name}" if variable.scope else variable.name
                for address in range(variable.address, variable.address + variable.type.size):
                    names[address] = name
    return names


def classes(rows: ResultRows) -> dict[str, Counter[str]]:
    """Variable -> count of flips by effect; most errors first, then faults, failures, other movements."""
    flips, keys = rows.column(FLIP), rows.keys(without=FLIP)
    without = {key: row for row, key in enumerate(keys) if flips[row] == NONE}
    columns = {name: rows.column(name) for name in FIGURES if name in rows.table.column_names}
    verdicts, failures = rows.column("verdict"), rows.column("failure")
    by_place: dict[str, Counter[str]] = {}
    for row, flip in enumerate(flips):
        other = without.get(keys[row])
        if flip == NONE or other is None:
            continue
        if failures[row] and failures[row].endswith(NO_EFFECT):
            kind = "no effect"
        elif verdicts[row] in SHARES and verdicts[row] != verdicts[other]:
            kind = verdicts[row]
        elif all(column[row] == column[other] for column in columns.values()):
            kind = "lies there"
        else:
            now, before = (columns[_POSITION][place] for place in (row, other))
            near = now is not None and before is not None and abs(now - before) < NEAR_CM
            kind = "within 1 mm" if near else "moves otherwise"
        by_place.setdefault(flip.rsplit(" ", 4)[0], Counter())[kind] += 1
    return dict(
        sorted(by_place.items(), key=lambda item: (*(-item[1][kind] for kind in CLASSES[:2:-1]), item[0]))
    )


def classes_table(rows: ResultRows) -> Table:
    """The classes of all flips, then of each variable."""
    by_place = classes(rows)
    table = plain_table("variable", right=("flips", *CLASSES))
    total: Counter[str] = sum(by_place.values(), Counter())
    for name, counts in {"all": total, **by_place}.items():
        table.add_row(name, f"{counts.total()}", *(f"{counts[kind]}" for kind in CLASSES))
    return table
