"""Where a plug-in went wrong is told of its own code, never of what loads it."""

from miro_host.raised import raised_at


def error_in(module):
    """What a line in this module raises."""
    try:
        exec(
            compile("def load():\n    raise AttributeError\nload()", f"{module}.py", "exec"),
            {"__name__": module},
        )
    except AttributeError as error:
        return error.with_traceback(error.__traceback__ and error.__traceback__.tb_next)
    raise AssertionError


def test_code_of_a_plug_in_is_the_place():
    assert raised_at(error_in("plugged")) == "plugged.py:2 in load"


def test_what_loads_plug_ins_is_no_place():
    assert raised_at(error_in("importlib_metadata")) == ""
