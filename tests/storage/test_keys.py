"""Keys stand in no file of ours, and whoever misses them is told where they are taken from."""

import json

import pytest
from tests.storage import servers

from racecraft.contract.errors import UserInputError
from racecraft.storage.address import Address, BucketError
from racecraft.storage.connection import S3Connection
from racecraft.storage.mirror_note import MirrorLocation, noted_place, write_note
from racecraft.storage.transfer import MIRROR

TAKEN_FROM = "Keys are taken from a profile of ~/.aws"


def test_a_note_holds_no_keys(tmp_path):
    write_note(
        tmp_path,
        MirrorLocation(Address("models", "car"), S3Connection("http://localhost:9000", "", "", "racer", "hidden")),
    )
    assert "hidden" not in (tmp_path / MIRROR).read_text()
    assert noted_place(tmp_path).access == S3Connection("http://localhost:9000")


@pytest.mark.parametrize("more", ["secret", "aws_access_key_id"])
def test_keys_that_somebody_wrote_into_a_note_are_refused(tmp_path, more):
    write_note(tmp_path, MirrorLocation(Address("models", "car")))
    note = json.loads((tmp_path / MIRROR).read_text())
    (tmp_path / MIRROR).write_text(json.dumps({**note, more: "hidden"}))
    with pytest.raises(BucketError, match=f"holds '{more}', which is not read there.*{TAKEN_FROM}") as said:
        noted_place(tmp_path)
    assert "hidden" not in str(said.value)


@pytest.mark.parametrize("endpoint", ["http://racer:hidden@localhost:9000", "https://hidden@localhost"])
def test_an_endpoint_that_holds_keys_is_refused_and_not_repeated(tmp_path, endpoint):
    with pytest.raises(BucketError, match=f"keys before its '@'.*{TAKEN_FROM}") as said:
        S3Connection(endpoint)
    assert "hidden" not in str(said.value)
    write_note(tmp_path, MirrorLocation(Address("models", "car")))
    note = json.loads((tmp_path / MIRROR).read_text())
    (tmp_path / MIRROR).write_text(json.dumps({**note, "endpoint": endpoint}))
    with pytest.raises(UserInputError, match="keys before its '@'"):
        noted_place(tmp_path)


@servers.needs_rclone
@pytest.mark.parametrize(
    ("key", "secret", "words"),
    [("", "", "who asks is not known"), ("racer", "another-secret", "does not take the keys")],
)
def test_who_has_no_keys_or_wrong_ones_is_told_where_they_are_taken_from(
    rclone_store, monkeypatch, tmp_path, key, secret, words
):
    from racecraft.storage.object_store import ObjectStore

    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "AWS_PROFILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "none"))
    monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "none"))
    store = ObjectStore(S3Connection(rclone_store.url, "", "us-east-1", key, secret))
    with pytest.raises(BucketError, match=f"{words}.*{TAKEN_FROM}"):
        store.listed(Address("bucket", ""))
