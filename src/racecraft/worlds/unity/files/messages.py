"""The messages of ML-Agents' protocol and files, as one table of fields.

Numbers, types and labels are those of the package `communicator_objects` (facts: unity-ml-agents, "Fields");
`racecraft.formats.protobuf_messages` says how the table is written. ML-Agents' own package cannot live beside a modern
protobuf, because its generated code is tied to an old one.

Begin at `Messages`; `load()` returns them, once per process.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from racecraft.formats.protobuf_messages import message_classes

PACKAGE = "communicator_objects"

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
    "DemonstrationMetaProto": (
        "1:api_version:int32 2:demonstration_name:string 3:number_steps:int32 4:number_episodes:int32 "
        "5:mean_reward:float"
    ),
    "AgentInfoActionPairProto": "1:agent_info:AgentInfoProto 2:action_info:AgentActionProto",
}

STATUS_OK, STATUS_GOODBYE = 200, 400
STEP, RESET = 0, 1
NO_COMPRESSION, PNG = 0, 1


class Messages(NamedTuple):
    """The classes that are built and parsed; every other message hangs inside one of these."""

    UnityMessage: Any
    AgentInfo: Any
    AgentAction: Any
    Observation: Any
    BrainParameters: Any
    DemonstrationMeta: Any
    AgentInfoActionPair: Any


@functools.cache
def load() -> Messages:
    """Build the message classes.

    >>> message = load().UnityMessage()
    >>> message.header.status = 200
    >>> message.SerializeToString().hex()
    '0a0308c801'
    """
    classes = message_classes(PACKAGE, FIELDS)
    return Messages(*(classes[f"{name}Proto"] for name in Messages._fields))
