"""How late an event loop looks at what happens, and when a request's first bytes were really there."""

from racecraft.serving.loop_lag import LoopLag


def test_one_hiccup_is_no_lasting_lateness_and_a_second_of_it_is():
    lag = LoopLag()
    lag.note(1.0)
    assert lag.lasting_seconds < 0.05
    for _ in range(50):
        lag.note(1.0)
    assert 0.5 < lag.lasting_seconds < 1.0
