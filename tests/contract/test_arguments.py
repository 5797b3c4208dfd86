"""Arguments of functions that stand for somebody else's."""

import pytest

from racecraft.contract.arguments import names_of, require_arguments
from racecraft.contract.errors import SettingError


def test_what_no_version_of_a_function_has_is_refused_and_its_own_affairs_are_not():
    require_arguments("ray.init", ["num_cpus", "_memory", "address"], iter(["num_cpus", "address"]))
    require_arguments("ray.init", [], [])
    for given in (["memory"], ["address", "memory"], ["memory_"]):
        with pytest.raises(SettingError, match=rf"ray.init has no argument '{given[-1]}'. Known: address, num_cpus"):
            require_arguments("ray.init", given, ["num_cpus", "address"])


def test_what_a_function_gathers_is_no_name_of_its():
    def made(first, /, second, *several, third=3, **others):
        return first

    assert names_of(made) == ["first", "second", "third"]
