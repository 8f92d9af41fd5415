"""Text files of other programs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.inputs import decode


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "gbk"])
def test_chinese_text_is_read_in_each_encoding_of_windows(encoding):
    assert decode("舵机 servo, 万年历\r\n".encode(encoding)) == "舵机 servo, 万年历\r\n"


@pytest.mark.parametrize("text", ["Z\xe4hler", "d\xe9j\xe0 vu", "100 \xb5s \xb1 5 \xb0", "10 \u20ac"])
def test_letters_of_western_windows_are_read(text):
    assert decode(text.encode("cp1252")) == text


@given(st.binary())
def test_any_bytes_are_text(data):
    assert isinstance(decode(data), str)


@given(st.text())
def test_utf8_is_read_as_it_is(text):
    assert decode(text.encode("utf-8-sig")) == text
