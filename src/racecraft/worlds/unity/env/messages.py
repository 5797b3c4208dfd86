"""The protocol's messages, built at run time from one table of fields.

No generated code: that ties a program to the protobuf release that made it, which is why ML-Agents' own package
cannot live beside a modern protobuf. The table below is turned into a descriptor in a *private* pool (so that an
imported `mlagents_envs` does not clash) and message classes come from there. Works with protobuf 4 to 7.

Numbers, types and labels are those of the package `communicator_objects` (facts: unity-ml-agents, "Fields"). Enums are
declared as int32: the bytes are the same, and a number from a later version is no error.

Begin at `Messages`; `load()` returns them, once per process.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from racecraft.worlds.unity.env.errors import missing_extra

PACKAGE = "communicator_objects"

# One line a message, one word a field: number:name:type, `*` marks repeated, `{}` a map from string to a message.
FIELDS = {
    "HeaderProto": "1:status:int32 2:message:string",
    "UnityMessageProto": "1:header:HeaderProto 2:unity_output:UnityOutputProto 3:unity_input:UnityInputProto",
    "UnityOutputProto": "1:rl_output:UnityRLOutputProto 2:rl_initialization_output:UnityRLInitializationOutputProto",
    "UnityInputProto": "1:rl_input:UnityRLInputProto 2:rl_initialization_input:UnityRLInitializationInputProto",
    "UnityRLCapabilitiesProto": (
        "1:baseRLCapabilities:bool 2:concatenatedPngObservations:bool 3:compressedChannelMapping:bool "
        "4:hybridActions:bool 5:trainingAnalytics:bool 6:variableLengthObservation:bool 7:multiAgentGroups:bool"
    ),
    "UnityRLInitializationInputProto": (
        "1:seed:int32 2:communication_version:string 3:package_version:string "
        "4:capabilities:UnityRLCapabilitiesProto 5:num_areas:int32"
    ),
    "UnityRLInitializationOutputProto": (
        "1:name:string 2:communication_version:string 3:log_path:string 5:brain_parameters:*BrainParametersProto "
        "7:package_version:string 8:capabilities:UnityRLCapabilitiesProto"
    ),
    "BrainParametersProto": (
        "3:vector_action_size_deprecated:*int32 5:vector_action_descriptions_deprecated:*string "
        "6:vector_action_space_type_deprecated:int32 7:brain_name:string 8:is_training:bool "
        "9:action_spec:ActionSpecProto"
    ),
    "ActionSpecProto": (
        "1:num_continuous_actions:int32 2:num_discrete_actions:int32 3:discrete_branch_sizes:*int32 "
        "4:action_descriptions:*string"
    ),
    "UnityRLOutputProto": "2:agentInfos:{}ListAgentInfoProto 3:side_channel:bytes",
    "ListAgentInfoProto": "1:value:*AgentInfoProto",
    "AgentInfoProto": (
        "7:reward:float 8:done:bool 9:max_step_reached:bool 10:id:int32 11:action_mask:*bool "
        "13:observations:*ObservationProto 14:group_id:int32 15:group_reward:float"
    ),
    "ObservationProto": (
        "1:shape:*int32 2:compression_type:int32 3:compressed_data:bytes/observation_data "
        "4:float_data:FloatData/observation_data "
        "5:compressed_channel_mapping:*int32 6:dimension_properties:*int32 7:observation_type:int32 8:name:string"
    ),
    "FloatData": "1:data:*float",
    "UnityRLInputProto": "1:agent_actions:{}ListAgentActionProto 4:command:int32 5:side_channel:bytes",
    "ListAgentActionProto": "1:value:*AgentActionProto",
    "AgentActionProto": (
        "1:vector_actions_deprecated:*float 4:value:float 6:continuous_actions:*float 7:discrete_actions:*int32"
    ),
}

STATUS_OK, STATUS_GOODBYE = 200, 400
STEP, RESET = 0, 1
NO_COMPRESSION, PNG = 0, 1


class Messages(NamedTuple):
    """The classes that the two sides build and parse; every other message hangs inside one of these."""

    UnityMessage: Any
    AgentInfo: Any
    AgentAction: Any
    Observation: Any
    BrainParameters: Any
    DecodeError: type[Exception]


@functools.cache
def load() -> Messages:
    """Build the message classes.

    Raises:
        MissingExtraError: protobuf is not installed.

    >>> message = load().UnityMessage()
    >>> message.header.status = 200
    >>> message.SerializeToString().hex()
    '0a0308c801'
    """
    try:
        from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
        from google.protobuf.message import DecodeError
    except ImportError as cause:
        raise missing_extra("protobuf") from cause
    file = descriptor_pb2.FileDescriptorProto(name="racecraft_unity.proto", package=PACKAGE, syntax="proto3")
    for name, fields in FIELDS.items():
        _describe(file.message_type.add(name=name), fields)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())

    def build(name: str) -> Any:
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{name}"))

    return Messages(
        build("UnityMessageProto"),
        build("AgentInfoProto"),
        build("AgentActionProto"),
        build("ObservationProto"),
        build("BrainParametersProto"),
        DecodeError,
    )


def _describe(message: Any, fields: str) -> None:
    """Fill one message's descriptor from its line of the table."""
    oneof_index: dict[str, int] = {}
    for word in fields.split():
        number, name, kind = word.split(":")
        kind, _, oneof = kind.partition("/")
        field = message.field.add(name=name, number=int(number))
        field.label = field.LABEL_REPEATED if kind[0] in "*{" else field.LABEL_OPTIONAL
        if kind.startswith("{}"):
            field.type, field.type_name = field.TYPE_MESSAGE, _map_entry(message, name, kind[2:])
        else:
            _set_type(field, kind.lstrip("*"))
        if oneof:
            if oneof not in oneof_index:
                oneof_index[oneof] = len(message.oneof_decl)
                message.oneof_decl.add(name=oneof)
            field.oneof_index = oneof_index[oneof]


def _map_entry(message: Any, field_name: str, value_type: str) -> str:
    """Add the hidden entry message that protobuf keeps for a map and return its full name."""
    name = "".join(word[0].upper() + word[1:] for word in field_name.split("_")) + "Entry"
    entry = message.nested_type.add(name=name)
    entry.options.map_entry = True
    for number, key, kind in ((1, "key", "string"), (2, "value", value_type)):
        field = entry.field.add(name=key, number=number)
        field.label = field.LABEL_OPTIONAL
        _set_type(field, kind)
    return f".{PACKAGE}.{message.name}.{name}"


def _set_type(field: Any, kind: str) -> None:
    if kind in FIELDS:
        field.type, field.type_name = field.TYPE_MESSAGE, f".{PACKAGE}.{kind}"
    else:
        field.type = getattr(field, f"TYPE_{kind.upper()}")
