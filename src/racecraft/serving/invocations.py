"""What an endpoint is asked, in every form it may be asked in, as arrays; and its answer in the form that was asked.

Forms of a request's body, by its Content-Type:

    application/json     {"instances": […]}   {"inputs": {…}}   […]       the shapes of TensorFlow Serving
    application/x-npy    one array, (R, …) or one row of it
    application/x-npz    several arrays, by the names of the observations
    image/png, image/jpeg   one picture, for a policy that sees one

Nothing that is opened can run code: arrays of objects are refused. What a body unpacks to is known before it is
unpacked: an array's header states its size, an archive's directory and a picture's header theirs.
"""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import nearest
from racecraft.contract.world import Array, ArraySpec, DiscreteActions
from racecraft.formats.archive import ArchiveError, Limits, members
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest, Reply

JSON, NPY, NPZ = "application/json", "application/x-npy", "application/x-npz"
NPY_BEGINS = b"\x93NUMPY"
IMAGES = ("image/png", "image/jpeg")
LIMITS = Limits(max_bytes=16 * 2**20, max_members=64)
"""What the arrays of one request may unpack to."""
MAX_PIXELS = 2**23
"""Of a picture: 4K has 8.3 million."""
MAX_NESTED = 32
"""Dimensions of an array."""
MAX_ROWS = 4096
"""Observations in one request."""
PASSED_OVER = (
    "prev_action", "prev_actions", "prev_reward", "prev_rewards", "is_training", "seq_lens", "timestep", "explore",
)  # fmt: skip
"""What RLlib's exported models were asked beside the observations; it changes nothing in a greedy answer."""
ANY_NAME = ("observations", "observation", "obs", "inputs", "data")
"""What a policy's only observation may be called, beside its own name."""
MASK = "action_mask"


@dataclass(frozen=True)
class InferenceRequest:
    """Observations of R rows."""

    observations: dict[str, Array]
    """By name, (R, …), in the type the policy reads."""
    action_mask: Array | None
    """bool (R, A)."""
    shape: str
    """How it was asked, for the answer: "inputs", "instances" or "npy"."""

    @property
    def rows(self) -> int:
        """R."""
        return len(next(iter(self.observations.values())))


@dataclass(frozen=True)
class InferenceResponse:
    """What a policy does."""

    actions: Array
    """(R, …)."""
    probabilities: Array | None = None
    """How likely each choice was, float32 (R, A); of policies over single choices."""


def read_question(request: ApiRequest, spec: PolicySpec) -> InferenceRequest:
    """Return what is asked.

    Raises:
        WebError: It is not what the policy sees; the message says what was found and what is expected.
    """
    kind = (request.header("content-type") or JSON).split(";")[0].strip().lower()
    if kind == JSON:
        return _from_json(request.json(), spec)
    if kind == NPY:
        return _question({_only(spec): _npy(request.body)}, spec, "npy")
    if kind == NPZ:
        return _question(_npz(request.body), spec, "npy")
    if kind in IMAGES:
        name = _only(spec)
        return _question({name: _picture(request.body, spec.visible[name])}, spec, "instances")
    raise WebError(415, "content_type", f"Content-Type is {kind!r}; expected {', '.join((JSON, NPY, NPZ, *IMAGES))}.")


def write_answer(answer: InferenceResponse, question: InferenceRequest, accept: str) -> Reply:
    """Return an answer in the form that was asked for: npy where that is accepted, or was sent; else JSON."""
    if not np.isfinite(answer.actions).all():
        raise WebError(500, "not_finite", "the policy answered NaN or infinity; train it again or serve another.")
    if NPY in accept or (question.shape == "npy" and JSON not in accept):
        buffer = io.BytesIO()
        np.save(buffer, answer.actions, allow_pickle=False)
        return Reply(buffer.getvalue(), NPY)
    actions = answer.actions.tolist()
    likely = None if answer.probabilities is None else answer.probabilities.tolist()
    if question.shape == "inputs":
        document: dict[str, Any] = {"outputs": {"actions": actions}}
        if answer.probabilities is not None:
            document["outputs"]["action_prob"] = answer.probabilities.max(axis=1).tolist()
            document["outputs"]["action_dist"] = likely
    else:
        rows = [{"actions": action} for action in actions]
        if likely is not None:
            rows = [{**row, "probabilities": part} for row, part in zip(rows, likely, strict=True)]
        document = {"predictions": rows}
    return Reply(msgspec.json.encode(document))


def signature(spec: PolicySpec) -> dict[str, Any]:
    """Return what an endpoint expects and gives, for `GET /`."""
    labels = list(spec.actions.labels) if isinstance(spec.actions, DiscreteActions) else []
    return {
        "observations": {
            name: {"shape": list(part.shape), "dtype": np.dtype(part.dtype).name, "doc": part.doc}
            for name, part in spec.visible.items()
        },
        "actions": spec.as_dictionary()["actions"],
        "labels": labels,
        "action_mask": spec.has_action_mask,
        "algorithm": spec.algorithm,
    }


def _from_json(body: Any, spec: PolicySpec) -> InferenceRequest:
    if isinstance(body, list):
        return _question(_rows(body, spec), spec, "instances")
    if not isinstance(body, dict):
        raise _bad(f"the body is {json.dumps(body)[:40]}; expected an object with instances or inputs, or a list.")
    if "instances" in body:
        return _question(_rows(body["instances"], spec), spec, "instances")
    inputs = body.get("inputs", {name: part for name, part in body.items() if name != "signature_name"})
    if not isinstance(inputs, dict):
        inputs = {_only(spec): inputs}
    return _question(inputs, spec, "inputs")


def _rows(instances: Any, spec: PolicySpec) -> dict[str, Any]:
    """Return columns of what is told row by row."""
    if not isinstance(instances, list) or not instances:
        raise _bad("instances is no list of observations; expected one, with at least one in it.")
    if not all(isinstance(row, dict) for row in instances):
        return {_only(spec): instances}
    names = list(instances[0])
    if any(list(row) != names for row in instances):
        raise _bad("the instances do not all have the same names; expected the same in each.")
    return {name: [row[name] for row in instances] for name in names}


def _question(body: Mapping[str, Any], spec: PolicySpec, shape: str) -> InferenceRequest:
    visible = spec.visible
    named: dict[str, Any] = {}
    for name, value in body.items():
        if name in visible or name == MASK:
            named[name] = value
        elif name in ANY_NAME and len(visible) == 1:
            named[next(iter(visible))] = value
        elif name not in PASSED_OVER:
            raise _bad(f"there is no observation '{name}'. {nearest(name, [*visible, MASK])}")
    missing = [name for name in visible if name not in named]
    if missing:
        raise _bad(f"{', '.join(missing)} missing; expected every observation: {', '.join(visible)}.")
    columns = {name: _column(name, named[name], part) for name, part in visible.items()}
    counts = {name: len(column) for name, column in columns.items()}
    if len(set(counts.values())) > 1:
        raise _bad(f"different numbers of rows: {counts}; expected the same of each.")
    rows = next(iter(counts.values()))
    if not 1 <= rows <= MAX_ROWS:
        raise _bad(f"{rows} rows; expected 1 to {MAX_ROWS}.")
    mask = _mask(named[MASK], rows) if MASK in named else None
    return InferenceRequest(columns, mask, shape)


def _column(name: str, value: Any, part: ArraySpec) -> Array:
    """Return one observation of R rows, in the type the policy reads."""
    if not isinstance(value, np.ndarray):
        _require_numbers(name, value)
    try:
        column = np.asarray(value)
    except (ValueError, OverflowError):
        raise _bad(f"{name}: rows of different shapes; expected {_shape(part)} each.") from None
    if column.dtype.kind not in "biuf":
        raise _bad(f"{name}: {column.dtype} values; expected numbers.")
    if column.shape == part.shape:
        column = column[None]
    if column.shape[1:] != part.shape or column.ndim == 0:
        raise _bad(f"{name}: shape {column.shape}; expected (rows, {', '.join(map(str, part.shape))}).")
    if column.size and not np.isfinite(column).all():
        raise _bad(f"{name}: values that are no numbers; expected finite ones.")
    if np.dtype(part.dtype).kind in "iu" and column.size:
        known = np.iinfo(part.dtype)
        if column.min() < known.min or column.max() > known.max:
            raise _bad(f"{name}: values from {column.min()} to {column.max()}; expected {known.min} to {known.max}.")
    return np.ascontiguousarray(column.astype(part.dtype))


def _mask(value: Any, rows: int) -> Array:
    if not isinstance(value, np.ndarray):
        _require_numbers(MASK, value)
    try:
        mask = np.asarray(value)
    except ValueError:
        raise _bad(f"{MASK}: rows of different lengths; expected ({rows}, choices).") from None
    mask = mask[None] if mask.ndim == 1 else mask
    if mask.ndim != 2 or len(mask) != rows or mask.dtype.kind not in "biuf":
        raise _bad(f"{MASK}: shape {mask.shape}; expected ({rows}, choices), true where a choice is allowed.")
    if not mask.astype(bool).any(axis=1).all():
        raise _bad(f"{MASK}: a row forbids every choice; expected at least one allowed.")
    return mask.astype(bool)


def _only(spec: PolicySpec) -> str:
    """Return the name of a policy's only observation."""
    names = list(spec.visible)
    if len(names) != 1:
        raise _bad(f'this policy sees {", ".join(names)}; expected each by its name, such as {{"inputs": {{…}}}}.')
    return names[0]


def _require_numbers(name: str, value: Any) -> None:
    """Refuse lists of anything but numbers: NumPy would make room for the longest text at every place."""
    rows, depth = [value] if isinstance(value, list) else [[value]], 0
    while rows:
        kinds = {kind for row in rows for kind in set(map(type, row))}
        if kinds - {int, float, bool, list} or (depth := depth + 1) > MAX_NESTED:
            found = ", ".join(sorted(kind.__name__ for kind in kinds))
            raise _bad(f"{name}: {found} values; expected numbers.")
        rows = [one for row in rows for one in row if isinstance(one, list)] if list in kinds else []


def _npy(body: bytes) -> Array:
    """Return an array, which is as large as the bytes behind its header."""
    file = io.BytesIO(body)
    try:
        version = np.lib.format.read_magic(file)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, in_columns, dtype = read_header(file)
    except (ValueError, EOFError, OSError) as error:
        why = error if body.startswith(NPY_BEGINS) else f"it does not begin with {NPY_BEGINS!r}"
        raise _bad(f"no NumPy array ({why}); expected what numpy.save writes, numbers only.") from None
    if dtype.kind not in "biuf" or len(shape) > MAX_NESTED or min(shape, default=0) < 0:
        raise _bad(f"no NumPy array of numbers ({dtype}, shape {shape}); expected what numpy.save writes.")
    data, stated = body[file.tell() :], math.prod(shape) * dtype.itemsize
    if len(data) != stated:
        raise _bad(f"no NumPy array (its header states {stated} bytes, {len(data)} follow); send the file whole.")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if in_columns else "C")


def _npz(body: bytes) -> dict[str, Array]:
    try:
        files = members(body, "what numpy.savez writes", LIMITS)
        return {str(file.path).removesuffix(".npy"): _npy(file.read()) for file in files}
    except ArchiveError as error:
        raise _bad(f"no NumPy arrays ({error.found}); expected what numpy.savez writes, numbers only.") from None


def _picture(body: bytes, part: ArraySpec) -> Array:
    """Return a picture as the policy sees it: its size by averaging areas, its channels as many as it has."""
    from PIL import Image, UnidentifiedImageError

    if not (len(part.shape) == 2 or (len(part.shape) == 3 and part.shape[2] in (1, 3))):
        raise _bad(f"this policy sees numbers of shape {part.shape}, no picture; expected {JSON} or {NPY}.")
    height, width = part.shape[:2]
    channels = part.shape[2] if len(part.shape) == 3 else 1
    try:
        with Image.open(io.BytesIO(body), formats=("PNG", "JPEG")) as opened:
            if math.prod(opened.size) > MAX_PIXELS:
                raise _bad(f"a picture of {math.prod(opened.size)} pixels; expected at most {MAX_PIXELS}.")
            picture = opened.convert("L" if channels == 1 else "RGB")
            if picture.size != (width, height):
                picture = picture.resize((width, height), Image.Resampling.BOX)
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        raise _bad(f"no picture ({error}); expected PNG or JPEG.") from None
    return np.asarray(picture, np.uint8).reshape(1, *part.shape)


def _shape(part: ArraySpec) -> str:
    return "one number" if part.shape == () else f"shape {part.shape}"


def _bad(message: str) -> WebError:
    return WebError(422, "bad_observation", message)
