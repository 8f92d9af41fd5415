"""How many mutants of the firmware `mirotwin conform` tells from the right one: the score of its rules.

    python -m tests.mutants.score [--count 180] [--seed 1997] [--jobs 2] [--planted | --alive | --only ID ..]
    python -m tests.mutants.score --rules P37 P55

`survivors.toml` says why mutants are alive that no rule kills: `because` is a sentence or two, `verdict` one of these.

    equivalent   nothing that anybody can do to a robot tells it from the right one
    allowed      it does something else, which the pages that bind a robot leave open
    unreachable  it does what they forbid, but only on a board that no world has (with a broken LM629, for example)
    missing      it does what they forbid, and no rule notices

The score is the share of killed ones among those that were drawn, without those that do not compile, those whose image
has the bytes of the shipped one, and those that are equivalent or allowed. Planted mistakes are counted apart.
`build/mutants/score.json` has what came of each. `--rules` tries those that are new or changed on all mutants of the
last score, and leaves in it what other rules made of them.

Exit code 1 if the score is below 95 %, if a planted mistake lives, if somebody alive has no explanation, or if a rule
kills nobody.
"""

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Literal

import msgspec

from mirotwin.campaign.workers import processes
from mirotwin.shell.processes import cores
from tests.mutants.build import CACHE, build, shipped
from tests.mutants.draw import COUNT, SEED, drawn, mutants_of, source_files
from tests.mutants.planted import PLANTED

SURVIVORS = Path(__file__).parent / "survivors.toml"
SCORE = CACHE / "score.json"
LEAST_SHARE = 0.95


class Survivor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    verdict: Literal["equivalent", "allowed", "unreachable", "missing"]
    because: str

    @property
    def conforms(self):
        """Whether no right rule can kill it."""
        return self.verdict in ("equivalent", "allowed")


def survivors():
    """By id."""
    return msgspec.toml.decode(SURVIVORS.read_bytes(), type=dict[str, Survivor])


class Job(msgspec.Struct, frozen=True):
    """A file of the firmware with a text that is a mutant's; `tried`: rules, () is all."""

    id: str
    diff: str
    planted: bool
    file: str
    text: str
    tried: tuple[str, ...] = ()


class Fate(msgspec.Struct, frozen=True):
    """What came of a mutant: `what` is `does not compile`, `same bytes`, `killed` (by these rules) or `alive`."""

    id: str
    diff: str
    planted: bool
    what: str
    rules: tuple[str, ...] = ()
    seconds: float = 0.0
    error: str = ""


class Score(msgspec.Struct, frozen=True):
    """Fates in the order of the draw, planted ones last. `rules`: all there are; `conform_seconds`: all of them on the
    shipped image.
    """

    seed: int
    rules: tuple[str, ...]
    conform_seconds: float
    fates: tuple[Fate, ...]


def jobs_of(count, seed, tried=()):
    """The mutants of a draw, and the planted ones."""
    sources = source_files()
    found = [
        Job(one.id, one.diff, False, one.file, one.change.applied(sources[one.file]), tried)
        for one in drawn(mutants_of(sources), count, seed)
    ]
    for name, one in PLANTED.items():
        found.append(Job(name, one.breaks, True, one.file, one.applied(sources[one.file]), tried))
    return found


def judged(image, tried=()):
    """Rules that an image breaks, each tried by itself, and the processor time; `tried`: () is all of them."""
    from miro_robot.image import load_hex  # a new process gets its engine first
    from mirotwin.conform.rules import RULES
    from mirotwin.conform.run import try_rule, with_faults

    rules = [rule for rule in RULES if not tried or rule.id in tried]
    begun = time.process_time()
    loaded = load_hex(image)
    outcomes = with_faults([try_rule(rule, loaded) for rule in rules], rules)
    return tuple(one.rule for one in outcomes if one.failures), time.process_time() - begun


def fate(job):
    """Builds and judges one mutant in this process."""
    built = build({job.file: job.text})
    found = Fate(job.id, job.diff, job.planted, "does not compile", error=built.error)
    if built.error:
        return found
    if built.is_shipped:
        return msgspec.structs.replace(found, what="same bytes")
    rules, seconds = judged(built.image, job.tried)
    return msgspec.structs.replace(found, what="killed" if rules else "alive", rules=rules, seconds=seconds)


def fates(jobs, count):
    """What comes of each job, in their order, by so many processes."""
    with processes(count) as executor:
        yield from executor.map(fate, jobs)


def merged(before, now, tried, rules):
    """What came of a mutant before, with what the `tried` ones of `rules` make of it now."""
    broken = {rule for rule in before.rules if rule not in tried} | set(now.rules)
    kept = tuple(rule for rule in rules if rule in broken)
    what = now.what if now.error or now.what == "same bytes" else "killed" if kept else "alive"
    return msgspec.structs.replace(before, what=what, rules=kept)


def share(found, known):
    """(killed, all that could be killed) of those that were drawn."""
    drawn_ones = [one for one in found if not one.planted]
    killed = len([one for one in drawn_ones if one.what == "killed"])
    alive = [one for one in drawn_ones if one.what == "alive"]
    return killed, killed + len([one for one in alive if not (one.id in known and known[one.id].conforms)])


def problems(score, known):
    """What is not as it has to be."""
    found = []
    killed, could = share(score.fates, known)
    if killed < LEAST_SHARE * could:
        found.append(f"killed {killed} of {could}, wanted {100 * LEAST_SHARE:.0f} %")
    for one in score.fates:
        if one.planted and one.what != "killed":
            found.append(f"planted mistake {one.id!r}: {one.what}")
        elif one.what == "alive" and one.id not in known:
            found.append(f"{one.id} is alive, and survivors.toml does not say why: {one.diff}")
        elif one.what == "killed" and one.id in known:
            found.append(f"{one.id} is in survivors.toml, but {', '.join(one.rules)} kills it")
    idle = set(score.rules) - {rule for one in score.fates for rule in one.rules}
    found += [f"rule {rule} kills nobody" for rule in sorted(idle)]
    return found


def last_score():
    """The last whole one. `SystemExit` where there is none."""
    if not SCORE.exists():
        sys.exit(f"{SCORE}: there is no score yet; run `python -m tests.mutants.score` first")
    return msgspec.json.decode(SCORE.read_bytes(), type=Score)


def chosen(asked):
    """The jobs that the options ask for."""
    jobs = jobs_of(asked.count, asked.seed, tuple(asked.rules))
    if asked.planted:
        return [job for job in jobs if job.planted]
    only = set(asked.only)
    if asked.alive:
        only = {one.id for one in last_score().fates if one.what == "alive"}
    return [job for job in jobs if job.id in only] if only else jobs


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=COUNT, help="mutants that are drawn")
    parser.add_argument("--seed", type=int, default=SEED, help="of the draw")
    parser.add_argument("--planted", action="store_true", help="planted mistakes alone")
    parser.add_argument("--only", nargs="+", default=[], metavar="ID", help="these alone")
    parser.add_argument("--alive", action="store_true", help="those alone that were alive in the last score")
    parser.add_argument(
        "--rules", nargs="+", default=[], metavar="RULE", help="these rules; the others as they were"
    )
    parser.add_argument("--jobs", type=int, default=cores(), help="processes")
    asked = parser.parse_args()
    whole = not (asked.planted or asked.only or asked.alive)
    jobs = chosen(asked)
    if not jobs:
        sys.exit("no such mutant")
    sys.exit(_score(jobs, asked, whole))


def _score(jobs, asked, whole):
    from mirotwin.conform.rules import RULES

    all_rules = tuple(rule.id for rule in RULES)
    broken, conform_seconds = judged(shipped().image)
    if broken:
        sys.exit(f"the shipped firmware breaks {', '.join(broken)}")
    before = {one.id: one for one in last_score().fates} if asked.rules else {}
    jobs = [job if job.id in before else msgspec.structs.replace(job, tried=()) for job in jobs]
    found = []
    for job, one in zip(jobs, fates(jobs, asked.jobs), strict=True):
        found.append(merged(before[one.id], one, tuple(asked.rules), all_rules) if one.id in before else one)
        said = " ".join(found[-1].rules) or found[-1].what
        if said == "alive":
            said += f", {os.path.relpath(build({job.file: job.text}).image)}"
        print(f"{len(found)}/{len(jobs)} {one.id}: {said} ({one.seconds:.1f} s)", file=sys.stderr, flush=True)
    score = Score(asked.seed, all_rules, conform_seconds, tuple(found))
    if whole:
        part = SCORE.with_suffix(".part")
        part.write_bytes(msgspec.json.format(msgspec.json.encode(score)))
        os.replace(part, SCORE)
    killed, could = share(found, survivors())
    print(f"killed {killed} of {could} drawn mutants that could be killed")
    planted = [one for one in found if one.planted]
    print(
        f"killed {len([one for one in planted if one.what == 'killed'])} of {len(planted)} planted mistakes"
    )
    against = problems(score, survivors()) if whole else []
    for line in against:
        print(line)
    return 1 if against else 0


if __name__ == "__main__":
    main()
