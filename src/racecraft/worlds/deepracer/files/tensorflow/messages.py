"""The messages of TensorFlow's graphs and checkpoints, as one table of fields. Begin with `load`.

The table names what we read and write; `racecraft.formats.protobuf_messages` says how it is written, and passes over
every other field. TensorFlow declares `attr` as a map, whose entries are the same bytes; a repeated field keeps the
order in which we write them, where protobuf's order of a map depends on its release.

Source: facts: TensorFlow's `graph.proto`, `node_def.proto`, `attr_value.proto`, `versions.proto`, `meta_graph.proto`,
`tensor.proto`, `tensor_shape.proto`, `tensor_bundle.proto`.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

from racecraft.formats.protobuf_messages import message_classes

PACKAGE = "tensorflow"
FIELDS = {
    "GraphDef": "1:node:*NodeDef 4:versions:VersionDef",
    "MetaGraphDef": "2:graph_def:GraphDef",
    "VersionDef": "1:producer:int32",
    "NodeDef": "1:name:string 2:op:string 3:input:*string 5:attr:*AttrEntry",
    "AttrEntry": "1:key:string 2:value:AttrValue",
    "AttrValue": (
        "1:list:ListValue/value 2:s:bytes/value 3:i:int64/value 4:f:float/value 5:b:bool/value 6:type:int32/value "
        "7:shape:TensorShapeProto/value 8:tensor:TensorProto/value"
    ),
    "ListValue": "3:i:*int64",
    "TensorShapeProto": "2:dim:*Dim",
    "Dim": "1:size:int64",
    "TensorProto": (
        "1:dtype:int32 2:tensor_shape:TensorShapeProto 4:tensor_content:bytes 5:float_val:*float 6:double_val:*double "
        "7:int_val:*int32 10:int64_val:*int64 11:bool_val:*bool"
    ),
    "BundleHeaderProto": "1:num_shards:int32 2:endianness:int32 3:version:VersionDef",
    "BundleEntryProto": (
        "1:dtype:int32 2:shape:TensorShapeProto 3:shard_id:int32 4:offset:int64 5:size:int64 6:crc32c:fixed32 "
        "7:slices:*bytes"
    ),
}


class Messages(NamedTuple):
    """The classes that are built and parsed; every other message hangs inside one of these."""

    GraphDef: Any
    MetaGraphDef: Any
    NodeDef: Any
    TensorShapeProto: Any
    TensorProto: Any
    BundleHeaderProto: Any
    BundleEntryProto: Any


@functools.cache
def load() -> Messages:
    """Build the message classes, once per process."""
    classes = message_classes(PACKAGE, FIELDS)
    return Messages(*(classes[name] for name in Messages._fields))
