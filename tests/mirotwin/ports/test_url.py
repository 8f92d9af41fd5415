"""What stands in a miro:// URL, and what is said of one that cannot be used."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from miro_exact.bad_input import BadInput
from mirotwin.ports.url import UrlOptions, parse_url


@pytest.mark.parametrize(
    ("url", "target"),
    [
        ("miro://fig6", UrlOptions("fig6")),
        ("miro://fig6/", UrlOptions("fig6")),
        ("MIRO://fig6?seed=7", UrlOptions("fig6", seed=7)),
        ("miro://my/own.toml?network=1", UrlOptions("my/own.toml", network=1)),
        ("miro:///tmp/a%20b.toml", UrlOptions("/tmp/a b.toml")),
        ("miro://fig6?set=a.b=1&set=c=%22x+y%22", UrlOptions("fig6", settings=("a.b=1", 'c="x+y"'))),
        (
            "miro://fig6?firmware=C:%5Cx.ihx&realtime=0.5",
            UrlOptions("fig6", firmware="C:\\x.ihx", realtime=0.5),
        ),
        ("miro://fig6?limit_s=10&out=runs/x", UrlOptions("fig6", limit_s=10.0, out="runs/x")),
    ],
)
def test_a_url_says_what_to_open(url, target):
    assert parse_url(url) == target


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("miro://", "names no scenario; give miro://fig6, for example"),
        ("loop://", "is no miro:// URL"),
        ("miro://fig6?sed=7", "sed: is no option of the URL; there are set, seed, firmware, network"),
        ("miro://fig6?seed=7&seed=8", "seed: stands twice"),
        ("miro://fig6?seed=-1", "seed: '-1' is no whole number from 0 to 9223372036854775807"),
        ("miro://fig6?seed=1e3", "seed: '1e3' is no whole number"),
        ("miro://fig6?network=32", "network: '32' is no whole number from 0 to 31"),
        ("miro://fig6?realtime=0", "realtime: '0' is no number above 0 and up to 1000"),
        ("miro://fig6?realtime=nan", "realtime: 'nan' is no number"),
        ("miro://fig6?limit_s=86401", "limit_s: '86401' is no number above 0 and up to 86400"),
        ("miro://fig6?out=", "out: '' is empty"),
    ],
)
def test_one_that_cannot_be_used_is_named_with_the_place_and_a_remedy(url, said):
    with pytest.raises(BadInput) as raised:
        parse_url(url)
    assert f"{url}: " in str(raised.value)
    assert said in str(raised.value)


@given(st.text(max_size=40))
def test_any_text_is_a_target_or_bad_input(text):
    for url in (text, f"miro://{text}", f"miro://fig6?{text}"):
        try:
            assert parse_url(url).scenario
        except BadInput as error:
            assert "\n" not in str(error)  # noqa: PT017
