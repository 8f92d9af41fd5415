"""Hardware faults of a stream file: recorded, replayed from the recording, and told by diff."""

import re

STREAM = """# mirotwin stream 3
#: scenario = "silent"
#: set = { duration_s = 0.3 }
792000 > 55 55
1600003 *@0/0 encoder left lost
2400000 *@0/0 lm629 right busy
3200001 *@0/0 rxd inverted
3200001 *@0/0 flip 2Ah.3
4800000 *@0/0 power dip
"""


def test_faults_are_recorded_and_done_again(mirotwin, tmp_path):
    (tmp_path / "faults.stream").write_text(STREAM)
    without = re.sub(r"\d+ \*.*\n", "", STREAM)
    (tmp_path / "plain.stream").write_text(without)
    for name in ("faults", "plain"):
        mirotwin.succeeds("replay", tmp_path / f"{name}.stream", "--out", tmp_path / name, "-q")
    assert "equals the recorded one in all" in mirotwin.succeeds("replay", tmp_path / "faults")
    told = mirotwin.ends(4, "diff", tmp_path / "plain", tmp_path / "faults")
    assert "A nothing, B robot 0 encoder left lost at tick 1600003" in told


def test_a_fault_of_a_robot_that_is_not_there_is_refused(mirotwin, tmp_path):
    path = tmp_path / "faults.stream"
    path.write_text(STREAM.replace("*@0/0 rxd", "*@0/2 rxd"))
    assert "tick 3200001: no robot in slot 2; there is 0" in mirotwin.refuses("replay", path)


def test_the_exported_stream_of_a_recording_has_its_faults(mirotwin, tmp_path):
    (tmp_path / "faults.stream").write_text(STREAM)
    mirotwin.succeeds("replay", tmp_path / "faults.stream", "--out", tmp_path / "run", "-q")
    mirotwin.succeeds("export", tmp_path / "run", "--out", tmp_path / "again.stream")
    text = (tmp_path / "again.stream").read_text()
    assert text.startswith("# mirotwin stream 3\n")
    assert re.findall(r"\d+ \*.*", text) == re.findall(r"\d+ \*.*", STREAM)
    mirotwin.succeeds("export", tmp_path / "run", "--out", tmp_path / "other.stream", "--network", "0")
    assert (tmp_path / "other.stream").read_text() == text
