"""The numbers on the page of the theory are those of the runs."""

import pytest

from tests.sim import theory_page
from tests.sim.theory_page import LAWS, QUOTES, RADIO, TABLES, THEORY, Quote, marked


@pytest.mark.parametrize("quote", QUOTES, ids=lambda quote: quote.sentence[:40])
def test_each_sentence_with_measured_numbers_stands_once_on_its_page(quote):
    assert len(quote.pattern.findall(quote.page.read_text())) == 1


def test_the_gains_that_cover_noise_are_those_of_the_scenario():
    (quote,) = [quote for quote in QUOTES if quote.page == RADIO]
    assert quote.written(RADIO.read_text()) == RADIO.read_text()


def test_a_number_is_replaced_and_nothing_else_also_where_the_sentence_is_broken():
    quote = Quote(THEORY, "from {} to {} cm.", lambda: ["0.70", "12"])
    assert quote.written("It fell from 1.5\nto -3 cm. So.") == "It fell from 0.70\nto 12 cm. So."


@pytest.mark.parametrize("text", ["nothing", "from 1 to 2 cm. Again from 1 to 2 cm."])
def test_a_sentence_that_is_not_there_once_is_an_error(text):
    with pytest.raises(ValueError, match="instead of once: from"):
        Quote(THEORY, "from {} to {} cm.", lambda: ["1", "2"]).written(text)


@pytest.mark.slow
@pytest.mark.parametrize("quote", QUOTES, ids=lambda quote: quote.sentence[:40])
def test_the_numbers_of_a_sentence_are_measured(quote):
    text = quote.page.read_text()
    assert quote.written(text) == text


def test_the_page_shows_columns_of_the_tables():
    for name, table in TABLES.items():
        assert not table.shown or marked(name).search(THEORY.read_text())[0].count(
            table.on_page(table.stored())
        )


@pytest.mark.slow
def test_the_table_of_whole_runs_is_measured():
    table = TABLES["in the loop"]
    assert len(table.stored()) == 1 + len(theory_page.loop.RUNS)
    assert table.rows() == table.stored()


@pytest.mark.slow
def test_a_row_of_laws_and_filters_is_measured():
    """Kanayama's, without a filter: it lifts assumption 3."""
    row = ["Kanayama", "none", *theory_page.from_random_starts(LAWS["Kanayama"], "none")]
    assert row in TABLES["law and filter"].stored()
    assert row[2].startswith(f"{theory_page.STARTS} of ")
