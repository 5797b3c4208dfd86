"""A folder behind an S3 address, asked by boto3 and by hand: what S3 promises, and what it must not do to a disk."""

import http.client
import importlib.util
import socket

import pytest

from racecraft.serving.buckets.server import BucketServer

pytestmark = pytest.mark.skipif(importlib.util.find_spec("boto3") is None, reason="no boto3 here")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "bucket" / "a").mkdir(parents=True)
    (tmp_path / "bucket" / "a" / "x.txt").write_bytes(b"0123456789")
    (tmp_path / "secret.txt").write_bytes(b"not yours")
    return tmp_path / "bucket"


@pytest.fixture
def server(folder):
    server = BucketServer({"bucket": folder})
    yield server.start().removeprefix("http://")
    server.close()


def client(address, key="k", secret="s"):
    import boto3
    from botocore.config import Config

    plain = Config(signature_version="s3v4", retries={"total_max_attempts": 1})
    return boto3.client(
        "s3",
        endpoint_url=f"http://{address}",
        aws_access_key_id=key,
        aws_secret_access_key=secret,
        region_name="us-east-1",
        config=plain,
    )


def refused(act, **asked):
    from botocore.exceptions import ClientError

    with pytest.raises(ClientError) as error:
        act(**asked)
    return error.value.response["Error"]["Code"]


def test_objects_are_files_and_files_are_objects(server, folder):
    s3 = client(server)
    s3.put_object(Bucket="bucket", Key="b/grüße & <more>.txt", Body=b"12")
    assert (folder / "b" / "grüße & <more>.txt").read_bytes() == b"12"
    assert [one["Key"] for one in s3.list_objects_v2(Bucket="bucket")["Contents"]] == [
        "a/x.txt",
        "b/grüße & <more>.txt",
    ]
    assert s3.get_object(Bucket="bucket", Key="a/x.txt", Range="bytes=3-5")["Body"].read() == b"345"
    assert s3.get_object(Bucket="bucket", Key="a/x.txt", Range="bytes=-2")["Body"].read() == b"89"
    s3.copy_object(Bucket="bucket", Key="c/copy", CopySource={"Bucket": "bucket", "Key": "a/x.txt"})
    s3.delete_objects(Bucket="bucket", Delete={"Objects": [{"Key": "a/x.txt"}, {"Key": "never/was"}]})
    assert sorted(path.name for path in folder.iterdir()) == ["b", "c"]
    assert (folder / "c" / "copy").read_bytes() == b"0123456789"


def test_pages_and_prefixes_are_as_at_s3(server, folder):
    for name in ("p/1", "p/2", "q/r/1", "q-1", "z"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"")
    s3 = client(server)
    for request in ("list_objects_v2", "list_objects"):
        pages = list(s3.get_paginator(request).paginate(Bucket="bucket", PaginationConfig={"PageSize": 2}))
        assert [one["Key"] for page in pages for one in page["Contents"]] == [
            "a/x.txt", "p/1", "p/2", "q-1", "q/r/1", "z"]  # fmt: skip
        assert len(pages) == 3
        top = s3.get_paginator(request).paginate(Bucket="bucket", Delimiter="/", PaginationConfig={"PageSize": 2})
        found = [page for page in top]
        assert [one["Prefix"] for page in found for one in page.get("CommonPrefixes", [])] == ["a/", "p/", "q/"]
        assert [one["Key"] for page in found for one in page.get("Contents", [])] == ["q-1", "z"]
    assert "Contents" not in s3.list_objects_v2(Bucket="bucket", Prefix="nothing/")


def test_parts_outlive_the_server(folder, tmp_path):
    first = BucketServer({"bucket": folder})
    s3 = client(first.start().removeprefix("http://"))
    upload = s3.create_multipart_upload(Bucket="bucket", Key="big")["UploadId"]
    one = s3.upload_part(Bucket="bucket", Key="big", UploadId=upload, PartNumber=1, Body=b"a" * 5)["ETag"]
    first.close()
    second = BucketServer({"bucket": folder})
    s3 = client(second.start().removeprefix("http://"))
    two = s3.upload_part(Bucket="bucket", Key="big", UploadId=upload, PartNumber=2, Body=b"b")["ETag"]
    assert [key["Key"] for key in s3.list_objects_v2(Bucket="bucket")["Contents"]] == ["a/x.txt"]
    parts = [{"PartNumber": 1, "ETag": one}, {"PartNumber": 2, "ETag": two}]
    s3.complete_multipart_upload(Bucket="bucket", Key="big", UploadId=upload, MultipartUpload={"Parts": parts})
    assert (folder / "big").read_bytes() == b"aaaaab"
    assert sorted(path.name for path in folder.iterdir()) == ["a", "big"]
    second.close()


def test_a_body_that_breaks_off_leaves_what_stood(server, folder):
    host, port = server.split(":")
    with socket.create_connection((host, int(port))) as wire:
        wire.sendall(f"PUT /bucket/a/x.txt HTTP/1.1\r\nHost: {server}\r\nContent-Length: 99\r\n\r\nhalf".encode())
        wire.shutdown(socket.SHUT_WR)
        while wire.recv(4096):
            pass
    assert (folder / "a" / "x.txt").read_bytes() == b"0123456789"
    assert [path.name for path in folder.iterdir()] == ["a"]


@pytest.mark.parametrize(
    "path",
    [
        "/bucket/../secret.txt",
        "/bucket/%2e%2e/secret.txt",
        "/bucket/a%2f..%2f..%2fsecret.txt",
        "/bucket//etc/passwd",
        "/bucket/out/secret.txt",
        "/bucket/link",
    ],
)
@pytest.mark.parametrize("method", ["GET", "PUT", "DELETE"])
def test_no_key_leads_out_of_the_folder(server, folder, method, path):
    (folder / "out").symlink_to(folder.parent)
    (folder / "link").symlink_to(folder.parent / "secret.txt")
    wire = http.client.HTTPConnection(server)
    wire.request(method, path, body=b"evil" if method == "PUT" else None)
    assert b"not yours" not in wire.getresponse().read()
    wire.close()
    assert (folder.parent / "secret.txt").read_bytes() == b"not yours"
    assert sorted(one.name for one in folder.parent.iterdir()) == ["bucket", "secret.txt"]


@pytest.mark.parametrize("head", [{"Host": "evil.example"}, {"Origin": "http://evil.example"}])
def test_no_page_of_a_browser_is_served(server, folder, head):
    wire = http.client.HTTPConnection(server)
    wire.request("PUT", "/bucket/a/x.txt", body=b"evil", headers=head)
    assert wire.getresponse().status == 403
    wire.close()
    assert (folder / "a" / "x.txt").read_bytes() == b"0123456789"


def test_refusals_have_the_names_of_s3(server, folder):
    s3 = client(server)
    assert refused(s3.get_object, Bucket="bucket", Key="none") == "NoSuchKey"
    assert refused(s3.list_objects_v2, Bucket="none") == "NoSuchBucket"
    assert refused(s3.put_object, Bucket="bucket", Key="a", Body=b"") == "InvalidRequest"
    assert refused(s3.put_object, Bucket="bucket", Key="a/x.txt/y", Body=b"") == "InvalidRequest"
    assert refused(s3.get_object, Bucket="bucket", Key="a/x.txt", Range="bytes=99-") == "InvalidRange"
    assert refused(s3.get_object, Bucket="bucket", Key="a/x.txt", IfMatch="another") == "PreconditionFailed"
    assert refused(s3.get_bucket_policy, Bucket="bucket") == "NotImplemented"
    assert refused(s3.create_bucket, Bucket="another") == "NotImplemented"


def test_signatures_are_looked_at_where_keys_are_given(folder):
    server = BucketServer({"bucket": folder}, {"racer": "secret"})
    address = server.start().removeprefix("http://")
    right = client(address, "racer", "secret")
    right.put_object(Bucket="bucket", Key="with blank+plus", Body=b"1")
    assert right.get_object(Bucket="bucket", Key="with blank+plus")["Body"].read() == b"1"
    link = right.generate_presigned_url("get_object", Params={"Bucket": "bucket", "Key": "a/x.txt"})
    wire = http.client.HTTPConnection(address)
    for target, status in ((link, 200), (link.replace("x.txt", "y.txt"), 403), ("/bucket/a/x.txt", 403)):
        wire.request("GET", target.removeprefix(f"http://{address}"))
        answer = wire.getresponse()
        answer.read()
        assert answer.status == status
    wire.close()
    assert refused(client(address, "racer", "guess").list_objects_v2, Bucket="bucket") == "SignatureDoesNotMatch"
    assert refused(client(address, "other", "secret").list_objects_v2, Bucket="bucket") == "InvalidAccessKeyId"
    server.close()
