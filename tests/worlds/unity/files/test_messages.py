"""Words of ML-Agents' protocol, as its documents number them."""

from racecraft.worlds.unity.files import messages


def test_words_of_the_protocol_have_its_numbers():
    """facts: unity-ml-agents, "Fields"."""
    assert (messages.STATUS_OK, messages.STATUS_GOODBYE) == (200, 400)
    assert (messages.STEP, messages.RESET) == (0, 1)
    assert (messages.NO_COMPRESSION, messages.PNG) == (0, 1)
