"""Files made to take all memory or all time: each is refused in a line, in little of both."""

import contextlib
import os
import sys
import time
from pathlib import Path

import pytest

from miro_exact.bad_input import BadInput
from miro_protocol import stream
from miro_robot.image.keil_map import parse_keil_map
from miro_robot.image.symbol_files import parse_cdb, parse_listing, parse_map
from mirotwin import campaign
from mirotwin.camera import picture
from mirotwin.campaign.page import arm_line
from mirotwin.campaign.rows import ResultRows
from tests import children
from tests.mirotwin.campaign.conftest import SHORT, InThisProcess, plan_of

SPARSE_BYTES = 2 << 30
MEMORY_BYTES = 1 << 30
"""Of address space, libraries included: far less than the file."""
LONG = 60_000
SECONDS = 5
"""Lines that took quadratic time took 27 s and more."""

FIRMWARE = Path(__file__).resolve().parents[2] / "robot_fw/miro_robot/firmware"


def limited():
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (30, 30))


def refused(folder, *words):
    """What the command says of bad input; it has little memory and time."""
    program = os.path.join(os.path.dirname(sys.executable), "mirotwin")
    small = {
        **os.environ,
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "ARROW_DEFAULT_MEMORY_POOL": "system",
    }
    done = children.run(
        [program, *words],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=limited,
        env=small,
    )
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert "Traceback" not in done.stderr
    *before, line = done.stderr.splitlines()
    assert all(": read as " in one for one in before)
    return line


@pytest.fixture
def sparse(tmp_path):
    """Makes a file of 2 GB that takes no room: zeros, behind a head."""

    def make(name, head=b""):
        path = tmp_path / name
        with path.open("wb") as file:
            file.write(head)
            file.truncate(SPARSE_BYTES)
        return name

    return make


FILES = {
    "an image": ("big.ihx", b":", ["run", "fig6", "--firmware", "big.ihx"]),
    "a scenario": ("big.toml", b"#", ["run", "big.toml"]),
    "a saved world": ("big.world", b"", ["run", "fig6", "--resume", "big.world"]),
    "a recording": ("big.mcap", b"", ["replay", "big.mcap"]),
    "a recording with its magic number": ("magic.mcap", b"\x89MCAP0\r\n", ["report", "magic.mcap"]),
    "a stream": ("big.stream", b"# mirotwin stream 2\n", ["replay", "big.stream"]),
    "a capture": ("big.pcapng", b"\x0a\x0d\x0d\x0a", ["decode", "big.pcapng"]),
    "a run to export": ("big.mcap", b"", ["export", "big.mcap", "--out", "x.pcapng"]),
    "a campaign": ("big.toml", b"#", ["campaign", "big.toml"]),
    "results of a campaign": ("big.parquet", b"PAR1", ["campaign", "show", "big.parquet"]),
    "a calibration": (
        "big.toml",
        b"#",
        ["camera", "calibrate", "--scenario", "fig6", "--initial", "big.toml", "--out", "x"],
    ),
    "points": ("big.toml", b"#", ["camera", "calibrate", "--points", "big.toml", "--out", "x.toml"]),
}


@pytest.mark.skipif(sys.platform != "linux", reason="limits of processes")
@pytest.mark.parametrize("name", FILES)
def test_two_gigabytes_of_zeros_are_refused_for(name, sparse, tmp_path):
    file, head, words = FILES[name]
    line = refused(tmp_path, *map(str, words)) if sparse(file, head) else ""
    assert f"{file}: " in line


@pytest.mark.skipif(sys.platform != "linux", reason="limits of processes")
@pytest.mark.parametrize("suffix", [".map", ".cdb"])
def test_two_gigabytes_beside_an_image_are_refused(suffix, sparse, tmp_path):
    (tmp_path / "mine.ihx").write_bytes((FIRMWARE / "miro.ihx").read_bytes())
    line = refused(tmp_path, "fw", "disasm", "mine.ihx") if sparse(f"mine{suffix}") else ""
    assert f"mine{suffix}: holds more than 64 MiB" in line


@pytest.mark.parametrize("head", [b"\x89PNG\r\n\x1a\n", b"P6\n#"])
def test_a_picture_of_two_gigabytes_is_refused_unread(head, sparse, tmp_path):
    with pytest.raises(BadInput, match="holds more than 4 MiB"):
        picture.read(tmp_path / sparse("big.png", head))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize("name", FILES)
def test_a_named_pipe_is_refused_for(name, tmp_path):
    file, _, words = FILES[name]
    os.mkfifo(tmp_path / file)
    refused(tmp_path, *words)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize("words", [("decode", "pipe"), ("export", "pipe", "--out", "x.stream")])
def test_a_named_pipe_is_not_waited_for_where_any_bytes_are_read(words, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "is a named pipe, which may never end" in refused(tmp_path, *words)


@pytest.mark.parametrize(
    ("reader", "line"),
    [
        (parse_map, "CABS" + " " * LONG + "x = 0. bytes (ABS,CON,CODE)"),
        (parse_map, "CABS " + "A" * LONG + " 00000000 = 0. bytes"),
        (parse_map, "C: " + " " * LONG + "00000000  _x"),
        (parse_keil_map, "BL51 LINKER/LOCATER\n" + " " * LONG + "C:0000H" + " " * LONG + "x"),
        (parse_keil_map, "  CODE 0000H 0000H" + " x" * LONG + " (" * LONG + ")"),
        (parse_cdb, "S:G$" + "a" * LONG + "$0_0$0(" + ")," * LONG + "C"),
        (parse_cdb, "L:C$" + "$" * LONG + ":00"),
        (parse_listing, " " * LONG + "1 ;\tmain.c:22"),
        (parse_listing, "      000000" + " 00" * LONG + "x"),
        (stream.parse, "# mirotwin stream 2" + " " * LONG + "x"),
        (stream.parse, "#: " + "a." * LONG + " = 3"),
        (stream.parse, "3 > " + "55 " * LONG + "#" + " " * LONG + "x"),
    ],
)
def test_a_long_line_takes_no_more_than_linear_time(reader, line):
    began_s = time.process_time()
    with contextlib.suppress(BadInput):
        reader(line)
    assert time.process_time() - began_s < SECONDS


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    pytest.importorskip("pyarrow", reason="needs pyarrow: the extra campaign")
    path = tmp_path_factory.mktemp("results") / "short.parquet"
    campaign.run(plan_of(SHORT), path, InThisProcess())
    return path


def changed(results, path, change=lambda table: table, about=lambda text: text):
    """The results with other columns, and saying other things of themselves."""
    import pyarrow.parquet as pq

    table = pq.read_table(results)
    text = table.schema.metadata[b"mirotwin_campaign"].decode()
    new = about(text)
    table = change(table).replace_schema_metadata({b"mirotwin_campaign": new.encode()})
    pq.write_table(table, path, compression="zstd")
    return path


def column(table, name, values, kind):
    import pyarrow as pa

    at = table.schema.get_field_index(name)
    return table.set_column(at, name, pa.array(values, kind))


def seeds(values, kind):
    import pyarrow as pa

    return lambda table: column(
        table, "seed", [values(row) for row in range(table.num_rows)], getattr(pa, kind)()
    )


def too_long(table):
    import pyarrow as pa

    return pa.table({"seed": pa.array(range(4), pa.int8()).take(pa.array(bytes(5_000_001), pa.int8()))})


def lists(table):
    import pyarrow as pa

    return column(table, "seed", [[1]] * table.num_rows, pa.list_(pa.int64()))


FACTOR = '"factors":["network.radio.bit_error_rate"]'
WRONG_RESULTS = {
    "many equal rows": (too_long, str, "more than 5000000"),
    "seeds that are lists": (lists, str, "column seed: holds list"),
    "seeds that are null": (seeds(lambda row: None, "int64"), str, "column seed: lacks a value in some row"),
    "seeds that are text": (seeds(str, "string"), str, "column seed: holds string"),
    "no seeds": (lambda table: table.drop_columns("seed"), str, "column seed: there is no such column"),
    "two columns of seeds": (
        lambda table: table.append_column("seed", table["seed"]),
        str,
        "there is no such column",
    ),
    "a factor 2000 times": (
        lambda table: table,
        lambda text: text.replace(FACTOR, '"factors":[' + ",".join(['"seed"'] * 2000) + "]"),
        "names a factor twice",
    ),
    "a factor that is no column": (
        lambda table: table,
        lambda text: text.replace(FACTOR, '"factors":["x"]'),
        "column x: there is no such column",
    ),
    "metadata that is no JSON": (lambda table: table, lambda text: text[:-1], "is no campaign's results"),
}


@pytest.mark.parametrize("name", WRONG_RESULTS)
def test_results_that_no_campaign_wrote_are_refused(name, results, tmp_path):
    change, about, said = WRONG_RESULTS[name]
    path = changed(results, tmp_path / "bad.parquet", change, about)
    with pytest.raises(BadInput) as caught:
        ResultRows(path)
    assert f"{path}" in str(caught.value)
    assert said in str(caught.value)


def test_results_that_vary_nothing_are_read(results, tmp_path):
    path = changed(results, tmp_path / "few.parquet", about=lambda text: text.replace(FACTOR, '"factors":[]'))
    assert list(ResultRows(path).groups(())) == [()]


def test_a_name_in_results_that_looks_like_an_option_is_a_file_in_the_line_to_copy(results, tmp_path):
    path = changed(
        results,
        tmp_path / "named.parquet",
        about=lambda text: text.replace('"scenario":"fig7"', '"scenario":"--out=x"'),
    )
    about, levels = ResultRows(path).about, {"network.radio.bit_error_rate": 0.0}
    assert arm_line(about, levels).startswith("mirotwin run ./--out=x --set ")
