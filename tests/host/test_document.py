"""The package's page: its example runs as it stands there."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "host" / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


def printed(code, capsys):
    exec(code, {"__name__": __name__})
    return capsys.readouterr().out.splitlines()


def test_the_first_example_prints_three_frames(capsys):
    frames = [bytes.fromhex(line) for line in printed(EXAMPLES[0], capsys)]
    assert [frame[5:8] for frame in frames] == [bytes.fromhex("ff 2d d4")] * 3


def test_the_law_of_the_second_example_is_driven_and_remembers(capsys):
    lines = [line.split() for line in printed(EXAMPLES[1], capsys)]
    speeds_m_s, errors_m = ([float(number) for number in column] for column in zip(*lines, strict=True))
    assert 0.0 < errors_m[0] < errors_m[1] < errors_m[2]
    assert all(0.0 < speed_m_s <= 0.5 for speed_m_s in speeds_m_s)


def test_the_page_names_every_module():
    package = PAGE.parent / "miro_host"
    paths = {path.relative_to(package).with_suffix("") for path in package.rglob("*.py")}
    modules = {path.as_posix() for path in paths if path.name != "__init__"}
    map_of_files = PAGE.read_text(encoding="utf-8").partition("```text\n")[2].partition("```")[0]
    named, folder = [], ""
    for word in map_of_files.split():
        folder = word if word.endswith("/") else folder
        named += [folder + word] if not word.endswith("/") else []
    assert sorted(named) == sorted(modules)
