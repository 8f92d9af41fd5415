"""Files a user names: read whole, but neither devices nor endless ones."""

import os

import pytest

from miro_exact.inputs import InputError, check_regular, read_input


def test_a_file_up_to_the_limit_is_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x" * (1 << 20))
    assert read_input(path, 1 << 20) == path.read_bytes()
    path.write_bytes(b"x" * ((1 << 20) + 1))
    with pytest.raises(InputError, match=r"holds more than 1 MiB; is this the right file\?"):
        read_input(path, 1 << 20)


def test_a_file_with_the_prefix_has_a_limit_of_its_own(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"ab" * 100)
    assert read_input(path, 10, prefix=b"ab", prefix_limit=200) == path.read_bytes()
    with pytest.raises(InputError):
        read_input(path, 10, prefix=b"ab", prefix_limit=199)
    with pytest.raises(InputError):
        read_input(path, 10, prefix=b"ba", prefix_limit=200)


def test_devices_are_refused_but_the_empty_one(tmp_path):
    if not os.path.exists("/dev/zero"):
        pytest.skip("this system has no /dev/zero")
    with pytest.raises(InputError, match="/dev/zero: is a device"):
        read_input("/dev/zero")
    with pytest.raises(InputError, match="/dev/zero: is not a regular file"):
        check_regular("/dev/zero")
    assert read_input("/dev/null") == b""
