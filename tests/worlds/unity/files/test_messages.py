"""What protobuf makes of the table of fields."""

from racecraft.worlds.unity.files import messages


def test_words_of_the_protocol_have_its_numbers():
    """facts: unity-ml-agents, "Fields"."""
    assert (messages.STATUS_OK, messages.STATUS_GOODBYE) == (200, 400)
    assert (messages.STEP, messages.RESET) == (0, 1)
    assert (messages.NO_COMPRESSION, messages.PNG) == (0, 1)


def test_a_map_is_an_entry_of_key_and_value_as_protoc_names_it():
    output = messages.load().UnityMessage.DESCRIPTOR.fields_by_name["unity_output"].message_type
    infos = output.fields_by_name["rl_output"].message_type.fields_by_name["agentInfos"].message_type
    inputs = messages.load().UnityMessage.DESCRIPTOR.fields_by_name["unity_input"].message_type
    actions = inputs.fields_by_name["rl_input"].message_type.fields_by_name["agent_actions"].message_type
    assert (infos.name, actions.name) == ("AgentInfosEntry", "AgentActionsEntry")
    assert [(field.name, field.number) for field in infos.fields] == [("key", 1), ("value", 2)]
    assert infos.GetOptions().map_entry


def test_one_of_two_kinds_of_data_is_sent():
    seen = messages.load().Observation.DESCRIPTOR
    assert [group.name for group in seen.oneofs] == ["observation_data"]
    assert [field.name for field in seen.oneofs[0].fields] == ["compressed_data", "float_data"]
