"""The journal of a campaign: a file to which each outcome is added as soon as it is there.

    {"mirotwin_campaign":1,"hash":"..","versions":{..},"runs":1000}
    {"run":0,"verdict":"passed",..}              one line an outcome, in the order in which they came

Each line is handed to the operating system at once, so a process that is killed loses none that it has written; the
last line may be cut off, and is left out. `fsync` follows at most once a second.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any, BinaryIO

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import check_regular
from mirotwin.campaign.plan import Head
from mirotwin.campaign.worker import RunOutcome
from mirotwin.shell.json_text import json_bytes
from mirotwin.shell.outputs import locked_elsewhere

SYNC_S = 1.0
_LINE_BYTES = 1 << 20
_BEGIN = b'{"mirotwin_campaign":'


def journal_path(results: Path) -> Path:
    """Path of the journal of unfinished results: noise.part.jsonl for noise.parquet."""
    return results.with_suffix(".part.jsonl")


class Journal:
    """The outcomes of a campaign, to be added to. `done[run]` is 1 for each run that has one.

    `discard`: empties the file first. Raises BadInput for a file of another campaign, or one that is no such
    file, and if another process writes to it.
    """

    def __init__(self, path: Path, head: Head, discard: bool = False) -> None:
        self.path = path
        self.head = head
        self.count = 0
        self.done = bytearray(head.runs)
        self._synced_s = perf_counter()
        check_regular(path)
        # unbuffered and appending: each line is one write, so a process that is killed leaves at most one cut line
        self._stream: BinaryIO = path.open("a+b", buffering=0)
        try:
            # Before anything is read or cut: another campaign may be in the middle of a line.
            if locked_elsewhere(self._stream.fileno()):
                remedy = "wait, or choose another file with --out"
                raise BadInput(path, "", "another process is writing to it", remedy)
            if discard:  # once it is locked: not from under another process
                self._stream.truncate(0)
            self._resume()
        # Ctrl-C too: the lock lasts as long as the stream is open.
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *raised: object) -> None:
        self._stream.close()

    def add(self, outcome: RunOutcome) -> None:
        """Writes the outcome of a run; a second one of the same run is left out."""
        if self.done[outcome.run]:
            return
        # Counted only after this: a run whose line a full disk refused stays missing, and runs again.
        self._append(json_bytes(outcome) + b"\n")
        self._count(outcome.run)
        # Not each time: waiting for the disk takes longer than many a run.
        if perf_counter() - self._synced_s >= SYNC_S:
            os.fsync(self._stream.fileno())
            self._synced_s = perf_counter()

    def _append(self, line: bytes) -> None:
        """Writes a whole line or nothing. Raises OSError."""
        begin, written = self._stream.seek(0, os.SEEK_END), 0
        try:
            # A disk that fills up takes the beginning of a line, and reports it only at the next write.
            while written < len(line):
                written += self._stream.write(line[written:])
        except BaseException:
            self._stream.truncate(begin)  # else the next line would be glued to the cut one
            raise

    def missing(self) -> Iterator[int]:
        """Runs without an outcome, ascending; runs added while iterating are skipped."""
        run = self.done.find(0)
        while run >= 0:
            yield run
            run = self.done.find(0, run + 1)

    def _count(self, run: int) -> None:
        self.done[run] = 1
        self.count += 1

    def _resume(self) -> None:
        """Reads what an earlier process has left, and cuts off a line that it could not finish."""
        head, whole = read_head(self.path)
        # Outcomes of another plan belong to other runs: seed or settings differ.
        difference = "" if head is None else self.head.difference(head)
        if head is None or (
            difference and next(outcomes(self.path), None) is None
        ):  # there is nothing to lose
            self._stream.truncate(0)
            self._append(json_bytes(self.head) + b"\n")
            return
        if difference:
            reason = f"holds the unfinished results of another campaign: {difference}"
            raise BadInput(
                self.path, "", reason, "choose another file with --out, or start again with --force"
            )
        for outcome, end in outcomes(self.path):
            if not 0 <= outcome.run < self.head.runs:
                raise BadInput(
                    self.path, "", f"has an outcome of run {outcome.run}", "start again with --force"
                )
            # Only lines that were understood: the file is cut behind the last of them.
            whole = end
            # As in `add`: of two outcomes of one run the first one counts.
            if not self.done[outcome.run]:
                self._count(outcome.run)
        self._stream.truncate(whole)  # else the next line would go on where the cut one ends


def read_head(path: Path) -> tuple[Head | None, int]:
    """The first line and where it ends; None where not even that was written. Raises BadInput for another file."""
    with path.open("rb") as stream:
        # Limited: a file of somebody else may be gigabytes without a line end.
        line = stream.readline(_LINE_BYTES)
    if not line.endswith(b"\n") and len(line) < _LINE_BYTES:
        # The beginning of our own first line: its writer was killed. Anything else is somebody's file, and is kept.
        if line and not _BEGIN.startswith(line[: len(_BEGIN)]):
            raise _no_journal(path)
        return None, 0
    try:
        return msgspec.json.decode(line, type=Head), len(line)
    except (msgspec.DecodeError, UnicodeDecodeError):
        raise _no_journal(path) from None


def _no_journal(path: Path) -> BadInput:
    return BadInput(path, "", "is not a campaign's journal", "choose another file with --out, or move it")


def outcomes(path: Path) -> Iterator[tuple[RunOutcome, int]]:
    """Each outcome of the file, and the offset after it. Raises BadInput for a line that is not one."""
    decoder: msgspec.json.Decoder[Any] = msgspec.json.Decoder(RunOutcome)
    with path.open("rb") as stream:
        end = len(stream.readline(_LINE_BYTES))
        for number, line in enumerate(iter(lambda: stream.readline(_LINE_BYTES), b""), 2):
            if len(line) == _LINE_BYTES:
                raise BadInput(
                    path, number, "the line is longer than any outcome", "start again with --force"
                )
            # Its writer was killed within the line: the run counts as missing.
            if not line.endswith(b"\n"):
                return
            end += len(line)
            try:
                outcome = decoder.decode(line)
            except (msgspec.DecodeError, UnicodeDecodeError):
                raise BadInput(path, number, "is no outcome of a run", "start again with --force") from None
            yield outcome, end


def in_order(outcomes: Iterable[RunOutcome]) -> Iterator[RunOutcome]:
    """Each run's outcome in the order of the plan; only those that came before their turn are held."""
    early: dict[int, RunOutcome] = {}
    turn = 0
    for outcome in outcomes:
        # Earlier ones were given out already: a second outcome of a run would be a row too many.
        if outcome.run >= turn:
            early.setdefault(outcome.run, outcome)
        while turn in early:  # one outcome may release several that were held
            yield early.pop(turn)
            turn += 1
    # A run has no outcome: those held for it follow.
    for run in sorted(early):
        yield early[run]
