"""Where a plug-in went wrong is told of its own code, never of what loads it."""

from miro_host.raised import raised, raised_at


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


def test_of_a_plug_in_in_this_tree_the_place_is_where_it_raised():
    error = called("mirotwin.verify.checks.course")
    assert raised(error) == "AttributeError (mirotwin.verify.checks.course.py:2 in load)"


def test_what_calls_a_plug_in_is_no_place():
    assert raised(called("importlib_metadata")) == "AttributeError"


def called(module: str) -> BaseException:
    """What a line in this module raises, called by ours."""
    names = {"__name__": module}
    exec(compile("def load():\n    raise AttributeError", f"{module}.py", "exec"), names)
    caller = {"__name__": "mirotwin.verify.checks.monitors", "load": names["load"]}
    try:
        exec("load()", caller)
    except AttributeError as error:
        return error.with_traceback(error.__traceback__ and error.__traceback__.tb_next)
    raise AssertionError
