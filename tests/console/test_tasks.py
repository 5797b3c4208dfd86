"""What a page asked for works in another thread, and whose code is refused is refused there, too."""

import threading

from racecraft.console import tasks
from racecraft.contract.loading import refuses_own_code


def test_a_strangers_command_is_confined_in_the_other_thread(monkeypatch, tmp_path):
    seen, done = [], threading.Event()

    def command(words, folder):
        seen.append((words[0], refuses_own_code.get()))
        return {}

    monkeypatch.setattr(tasks, "run_command", command)
    made = tasks.Tasks()
    for name, is_stranger in (("mine", False), ("theirs", True)):
        token = refuses_own_code.set(is_stranger)
        made.begin(name, "Explaining", [name], tmp_path, lambda told: done.set() if len(seen) == 2 else None)
        refuses_own_code.reset(token)
    assert done.wait(60)
    made.close()
    assert seen == [("mine", False), ("theirs", True)]
