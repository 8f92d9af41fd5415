"""`mirotwin export --as csv`: a table for each channel, whose columns name their units and hold what was recorded."""

import csv
import os
from io import StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_protocol import stream
from miro_protocol.transmission import Transmission
from mirotwin.recording import reader
from mirotwin.recording.channels import ControlMessage
from mirotwin.report.tables import Tables, message_rows, wire_row


@pytest.fixture(scope="module")
def exported(mirotwin, finished, tmp_path_factory):
    """The folder of the tables of a run, and what was said."""
    folder = tmp_path_factory.mktemp("tables")
    return folder, mirotwin.succeeds("export", finished / "run.mcap", "--out", folder / "run.csv")


def table(folder, name):
    with open(folder / f"run-{name}.csv", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def periods(finished):
    return reader.read(finished / "run.mcap").periods


def test_each_channel_is_a_table_named_after_it(exported):
    folder, said = exported
    names = set(os.listdir(folder))
    assert {name for name in names if "robot" not in name} == {
        "run-net0-wire.csv",
        "run-period.csv",
    }
    of_one = {name.removeprefix("run-net0-robot0-") for name in names if "-robot0-" in name}
    kinds = ("reference", "truth", "control", "lm629", "lm629-commands", "pwm")
    assert of_one >= {f"{kind}.csv" for kind in kinds}
    assert f"and {len(names) - 1} more: " in said


def test_postures_are_those_of_the_recording_to_the_last_bit(exported, periods):
    found = table(exported[0], "net0-robot0-truth")
    names = ["tick", "time_s", "x_m", "y_m", "theta_rad", "v_m_s", "w_rad_s"]
    assert list(found[0]) == names
    robots = [period.robots[0] for period in periods]
    assert [tuple(map(float, (row["x_m"], row["y_m"], row["theta_rad"]))) for row in found] == [
        (one.truth.x_m, one.truth.y_m, one.truth.theta_rad) for one in robots
    ]
    assert [(int(row["tick"]), row["time_s"]) for row in found] == [
        (period.tick, f"{period.tick / 24e6:.9f}") for period in periods
    ]


def test_wheels_are_in_counts_and_counts_per_sample(exported, periods):
    found = table(exported[0], "net0-robot0-lm629")
    assert [
        (
            int(row["left_real_position_counts"]),
            65536 * float(row["right_desired_velocity_counts_per_sample"]),
        )
        for row in found
    ] == [(one.robots[0].left.real_position, one.robots[0].right.desired_velocity) for one in periods]
    wanted = [row["left_counts_per_sample"] for row in table(exported[0], "net0-robot0-control")]
    assert [256 * float(one) for one in wanted] == [
        period.robots[0].control.left for period in periods if period.robots[0].control
    ]


def test_each_command_of_a_motion_controller_is_a_row_in_the_order_of_time(exported, periods):
    found = table(exported[0], "net0-robot0-lm629-commands")
    ticks = [int(row["tick"]) for row in found]
    assert ticks == sorted(ticks)
    logged = [("left", *one) for period in periods for one in period.robots[0].left.commands]
    logged += [("right", *one) for period in periods for one in period.robots[0].right.commands]
    rows = [(row["chip"], int(row["tick"]), int(row["opcode"]), row["data_hex"]) for row in found]
    assert sorted(rows) == sorted(logged)
    assert {"LFIL", "LTRJ", "STT"} <= {row["name"] for row in found}


def test_one_channel_is_one_file_or_standard_output(mirotwin, finished, exported, tmp_path):
    name = "net0/robot0/truth"
    mirotwin.succeeds("export", finished / "run.mcap", "--out", tmp_path / "a.csv", "--channel", name)
    whole = (exported[0] / "run-net0-robot0-truth.csv").read_text()
    assert os.listdir(tmp_path) == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == whole
    assert mirotwin.succeeds("export", finished / "run.mcap", "--out", "-", "--channel", f"/{name}") == whole


def test_the_folder_of_a_run_stands_for_its_recording(mirotwin, finished, tmp_path):
    mirotwin.succeeds("export", finished, "--out", tmp_path / "run.csv", "--channel", "period", "-q")
    assert len((tmp_path / "run.csv").read_text().splitlines()) == 7


def test_a_channel_that_is_not_there_is_refused_with_those_that_are(mirotwin, finished, tmp_path):
    said = mirotwin.refuses(
        "export", finished / "run.mcap", "--out", tmp_path / "a.csv", "--channel", "truth"
    )
    assert "--channel truth: has no rows; tables that have some: " in said
    assert "net0/robot0/truth" in said
    assert os.listdir(tmp_path) == []


def test_standard_output_takes_one_table(mirotwin, finished):
    said = mirotwin.refuses("export", finished / "run.mcap", "--out", "-", "--as", "csv")
    assert "takes one table, and a recording is several; give --channel" in said


def test_a_table_that_is_there_is_replaced_by_force_only(mirotwin, finished, tmp_path):
    (tmp_path / "run-period.csv").write_text("mine")
    line = ("export", finished / "run.mcap", "--out", tmp_path / "run.csv")
    assert "run-period.csv: is there already" in mirotwin.refuses(*line)
    assert os.listdir(tmp_path) == ["run-period.csv"], "nothing else was written"
    mirotwin.succeeds(*line, "--force")
    assert (tmp_path / "run-period.csv").read_text().startswith("tick,time_s,index,digest\n")


@pytest.mark.parametrize("name", ["x.vcd", "x.csvx", "x.pcap"])
def test_a_suffix_that_is_not_written_is_refused_with_those_that_are(mirotwin, finished, tmp_path, name):
    said = mirotwin.refuses("export", finished / "run.mcap", "--out", tmp_path / name)
    assert (
        f"files that end in {name[1:]} are not written; end it in .pcapng, .stream, .txt, .mcap, .csv" in said
    )
    assert ("mirotwin fw vcd" in said) == (name == "x.vcd")
    assert os.listdir(tmp_path) == []


def test_as_says_the_form_whatever_the_suffix_is(mirotwin, finished, tmp_path):
    mirotwin.succeeds("export", finished / "run.mcap", "--out", tmp_path / "x.log", "--as", "stream")
    assert stream.read(tmp_path / "x.log").entries


def test_of_a_recording_cut_short_all_that_could_be_read_is_written(mirotwin, finished, tmp_path, exported):
    whole = (finished / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) * 3 // 4])
    err = mirotwin("export", tmp_path / "cut.mcap", "--out", tmp_path / "run.csv")[2]
    rows = table(tmp_path, "net0-robot0-truth")
    assert rows == table(exported[0], "net0-robot0-truth")[: len(rows)]
    assert rows
    assert "cut.mcap" in err


def test_one_network_of_several_is_chosen(mirotwin, tmp_path):
    sent = [Transmission(5, ">", b"a"), Transmission(6, "<", b"bc", 1, (1,))]
    stream.write(tmp_path / "a.stream", sent)
    mirotwin.succeeds("export", tmp_path / "a.stream", "--out", tmp_path / "a.csv", "--network", 1)
    head, row = (tmp_path / "a.csv").read_text().splitlines()
    assert head == "tick,time_s,network,direction,data_hex,bad_stop"
    assert row == "6,0.000000250,1,<,6263,1"


@given(
    st.lists(
        st.builds(
            Transmission, st.integers(0, 1 << 60), st.sampled_from("<>"), st.binary(min_size=1, max_size=9)
        )
    )
)
def test_the_table_of_any_capture_holds_its_characters(sent):
    rows = [wire_row(one)[1] for one in sent]
    text = StringIO()
    writer = csv.DictWriter(text, rows[0] if rows else [])
    writer.writerows(rows)
    back = csv.DictReader(StringIO(text.getvalue()), rows[0] if rows else [])
    assert [(int(row["tick"]), row["direction"], bytes.fromhex(row["data_hex"])) for row in back] == [
        (one.tick, one.direction, one.data) for one in sent
    ]


def test_a_value_that_no_row_before_had_is_refused_and_not_lost(tmp_path):
    first, second = (
        dict(message_rows("control", ControlMessage(tick, 0.0, 0.0, 0, 0, {name: 1.0}), 24_000_000))[
            "control"
        ]
        for tick, name in ((1, "u1"), (2, "u2"))
    )
    with Tables(f"{tmp_path / 'x.csv'}", True, None, False, "run.mcap") as tables:
        tables.add("control", first)
        with pytest.raises(ValueError, match=r"tick 2: inner\.u2 is not in the rows before"):
            tables.add("control", second)
