"""The messages of wellspace.v1, made of the descriptors that the build has put beside this file.

They are in a pool of their own. A generated module would register them in the pool of the process, where another
package may have `google/rpc/status.proto` in another version; protobuf then refuses the second.
"""

from __future__ import annotations

import importlib.resources
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

_DESCRIPTORS = "_api.binpb"


def _load() -> descriptor_pool.DescriptorPool:
    resource = importlib.resources.files(__package__).joinpath(_DESCRIPTORS)
    try:
        serialized = resource.read_bytes()
    except FileNotFoundError as error:
        raise ImportError(
            f"{resource} is missing: this is the source of wellspace, not a build of it; see its README.md"
        ) from error
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(serialized).file:
        pool.AddSerializedFile(file.SerializeToString())
    return pool


_pool = _load()
_factory = None if hasattr(message_factory, "GetMessageClass") else message_factory.MessageFactory(_pool)
_classes: dict[str, Any] = {}


def message(name: str) -> Any:
    """The class of a message, by its full name or by that in wellspace.v1."""
    if name not in _classes:
        full = name if "." in name else f"wellspace.v1.{name}"
        descriptor = _pool.FindMessageTypeByName(full)
        _classes[name] = (
            _factory.GetPrototype(descriptor) if _factory is not None else message_factory.GetMessageClass(descriptor)
        )
    return _classes[name]


def enum_names(name: str) -> dict[int, str]:
    """The names of the values of an enum of wellspace.v1, without the prefix that all have in common, in lower case."""
    values = _pool.FindEnumTypeByName(f"wellspace.v1.{name}").values
    prefix = values[0].name.removesuffix("UNSPECIFIED")
    return {value.number: value.name.removeprefix(prefix).lower().replace("_", "-") for value in values}


def enum_numbers(name: str) -> dict[str, int]:
    """The other way round, without that which stands for none of them."""
    return {text: number for number, text in enum_names(name).items() if number != 0}
