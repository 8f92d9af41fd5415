"""`python -m benchmarks.against`: where it finds a tree's packages, and how it states what it measured."""

from pathlib import Path

from benchmarks import against, against_copy


def test_packages_of_either_layout_are_found():
    old = ["protocol/miro_protocol", "robot_fw/miro_robot", "robot_fw/miro_robot/mcs51", "sim/miro_sim"]
    new = ["exact/miro_exact", "sim/miro_sim", "mirotwin", "mirotwin/run", "tests/naive", "examples/laws"]
    folder = Path("copy")
    assert against_copy._roots(folder, old) == (folder / "protocol", folder / "robot_fw", folder / "sim")
    assert against_copy._roots(folder, new) == (folder / "exact", folder / "sim", folder)


def test_this_tree_has_its_folders():
    folders = [root.name for root in against_copy.this_tree().roots]
    assert folders == ["exact", "host", "protocol", "robot_fw", "sim", against_copy.HERE.name]


def test_a_row_states_medians_ratio_and_quartiles():
    task = against.Task("loop", "something", ("ms", 1e3), 5, lambda side: (0.0, ""))
    pairs = [(0.002, 0.001), (0.004, 0.001), (0.002, 0.002), (0.006, 0.002), (0.005, 0.001)]
    assert " ".join(against.row(task, pairs, True).split()) == "something 4 1 ms 3.00 2.00 .. 4.00 5"
    assert against.row(task, pairs, False).endswith("results differ")


def test_the_sides_take_turns_at_being_first():
    order = []

    def measure(side):
        order.append(side)
        return 1.0 if side == "other" else 2.0, f"digest of {side}"

    task = against.Task("loop", "something", ("ms", 1e3), 3, measure)
    found, equal = against.in_pairs(task, "other", "own")
    assert found == [(1.0, 2.0)] * 3
    assert not equal
    assert order[2:] == ["other", "own", "own", "other", "other", "own"]


def test_a_worker_measures_this_tree(tmp_path):
    side = against.Side(against_copy.this_tree(), tmp_path / "side")
    elapsed_s, digest = side.ask("construction")
    side.end()
    assert elapsed_s > 0.0
    assert digest == ""
