"""What a body unpacks to is known before it is unpacked: small requests that ask for much memory are refused."""

import io
import json
import tracemalloc
import zipfile

import numpy as np
import pytest
from PIL import Image

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.world import ArraySpec, DiscreteActions
from racecraft.serving.invocations import MAX_PIXELS, InferenceRequest, InferenceResponse, read_question, write_answer
from racecraft.web.errors import WebError
from racecraft.web.json_api import ApiRequest

JSON, NPY, NPZ = "application/json", "application/x-npy", "application/x-npz"


def spec_of(shape=(3,), dtype=np.float32):
    return PolicySpec("ppo", {"state": ArraySpec(shape, dtype)}, DiscreteActions(2))


def header(shape, dtype="<f8"):
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": dtype, "fortran_order": False, "shape": shape})
    return file.getvalue()


def zipped(data):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("state.npy", data)
    return file.getvalue()


def huge_png():
    """Return a PNG of 10,000 × 8,000 pixels, of one colour: about 10 kB."""
    file = io.BytesIO()
    Image.new("1", (10_000, 8_000)).save(file, "PNG")
    assert len(file.getvalue()) < 100_000
    return file.getvalue()


BOMBS = {
    "an array that claims 8 TB": (NPY, lambda: header((10**12,)) + b"0" * 64, "states 8000000000000 bytes, 64 follow"),
    "an array of a negative size": (NPY, lambda: header((-1, 3)) + b"0" * 24, "no NumPy array of numbers"),
    "an archive of zeros": (NPZ, lambda: zipped(b"\0" * (40 * 2**20)), "unpacks to more than 16 MiB"),
    "an archived array that claims 8 TB": (NPZ, lambda: zipped(header((10**12,))), "states 8000000000000 bytes"),
    "a text as wide as long": (JSON, lambda: json.dumps([["x" * 100_000], *[["a"]] * 30_000]).encode(), "str values"),
    "lists in lists": (JSON, lambda: b"[" * 500 + b"]" * 500, "list values"),
    "lists without end": (JSON, lambda: b"[" * 500_000, "nested too deep"),
    "a picture of 80 million pixels": ("image/png", huge_png, f"expected at most {MAX_PIXELS}"),
}


@pytest.mark.parametrize("what", BOMBS)
def test_a_small_body_that_asks_for_much_memory_is_refused_by_name(what):
    kind, body, message = BOMBS[what]
    spec = spec_of((24, 32), np.uint8) if kind == "image/png" else spec_of()
    request = ApiRequest("POST", "/invocations", body(), 0.0, [(b"content-type", kind.encode())])
    tracemalloc.start()
    try:
        with pytest.raises(WebError, match=message) as refused:
            read_question(request, spec)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 400 <= refused.value.status < 500
    assert peak < 64 * 2**20


def test_no_answer_holds_a_number_that_json_lacks():
    question = InferenceRequest({}, None, "instances")
    with pytest.raises(WebError, match="the policy answered NaN") as refused:
        write_answer(InferenceResponse(np.array([[np.nan]])), question, "")
    assert refused.value.status == 500
