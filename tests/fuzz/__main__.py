"""`python -m tests.fuzz [TARGET ..] [--time 60s]`: fuzzes our own code, guided by what it executes."""

import argparse
import re
import sys
from pathlib import Path

from tests.fuzz import campaign, corpus
from tests.fuzz.catalogue import TARGETS


def _seconds(text):
    match = re.fullmatch(r"([0-9]{1,6}(?:\.[0-9]+)?)(s|m|h|)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no time; give 60s, 10m or 1h")
    return float(match[1]) * {"s": 1, "": 1, "m": 60, "h": 3600}[match[2]]


def _parser():
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description="Fuzzes Mirotwin's own code.")
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all, one after the other")
    parser.add_argument("--list", action="store_true", help="names and what they are")
    parser.add_argument("--time", type=_seconds, default=60.0, help="for each target: 60s, 10m; default 60s")
    parser.add_argument("--seed", type=int, default=0, help="of the changes; default 0")
    parser.add_argument(
        "--sanitize", action="store_true", help="compiled modules under the address and UB sanitizers"
    )
    parser.add_argument(
        "--plain", action="store_true", help="changes by chance, even where Atheris is installed"
    )
    parser.add_argument(
        "--keep", action="store_true", help="choose the kept inputs again, from all that were found"
    )
    parser.add_argument("--run", type=Path, metavar="FILE", help="one input, with its traceback")
    return parser


def main():
    """0 when nothing was found, 1 for a finding, 2 for a wrong command line or a missing tool."""
    options = _parser().parse_args()
    unknown = [name for name in options.targets if name not in TARGETS]
    if unknown:
        print(f"there is no target {unknown[0]!r}; --list names them", file=sys.stderr)
        return 2
    if options.list:
        for name, target in TARGETS.items():
            print(f"{name:16} {target.what} ({len(corpus.kept(name))} kept inputs)")
        return 0
    names = options.targets or list(TARGETS)
    if options.run is not None:
        if len(names) != 1:
            print("--run takes one TARGET", file=sys.stderr)
            return 2
        return campaign.once(names[0], options.run, options.sanitize)
    try:
        engine = campaign.prepared(options.plain, options.sanitize)
    except campaign.MissingError as error:
        print(error, file=sys.stderr)
        return 2
    print(engine.about, flush=True)
    bad = 0
    for name in names:
        result = engine.run(name, options.time, options.seed)
        bad += result.finding is not None
        print(result.line(name), flush=True)
        if options.keep and result.finding is None:
            print(f"{'':16} {campaign.keep(name)} inputs kept", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
