"""Folders up and down over a real wire to a real store, and what is left when the wire breaks."""

import pytest
from tests.storage.servers import Store, Wire, empty, needs_s3

from racecraft.formats.run_folder import RunFolder
from racecraft.storage.address import Address, BucketError
from racecraft.storage.etags import PART_BYTES
from racecraft.storage.object_store import NetworkError
from racecraft.storage.transfer import files_below, pull, push

pytestmark = needs_s3

FILES = {
    "job.json": b"{}",
    "metrics.jsonl": b'{"iteration": 1}\n',
    "checkpoints/checkpoints.json": b'{"last": 1}',
    "checkpoints/1.policy.safetensors": b"p" * 40_000,
    "checkpoints/1.state.safetensors": b"s" * 90_000,
    "training-simtrace/0-iteration.csv": "episode,größe\n".encode(),
    "empty": b"",
}
AT = Address("bucket", "models/fast-car")


@pytest.fixture
def run(tmp_path):
    folder = tmp_path / "run"
    for name, data in FILES.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder


def as_found(folder):
    return {name: path.read_bytes() for name, path in files_below(folder).items()}


def test_a_folder_comes_back_as_it_went(store, run, tmp_path):
    for name in ("run.lock", "stop", "half.part"):
        (run / name).write_bytes(b"of this moment")
    done = push(store.open(), run, AT)
    assert store.contents() == {f"models/fast-car/{name}": data for name, data in FILES.items()}
    assert done.moved[-2:] == ("checkpoints/checkpoints.json", "job.json")
    pull(store.open(), AT, tmp_path / "back")
    assert as_found(tmp_path / "back") == FILES


def test_what_stands_there_is_passed_over(store, run, tmp_path):
    push(store.open(), run, AT)
    assert push(store.open(), run, AT).moved == ()
    (run / "metrics.jsonl").write_bytes(FILES["metrics.jsonl"][::-1])  # as long as it was
    assert push(store.open(), run, AT).moved == ("metrics.jsonl",)
    pull(store.open(), AT, tmp_path / "back")
    (tmp_path / "back" / "empty").unlink()
    again = pull(store.open(), AT, tmp_path / "back")
    assert (again.moved, again.skipped) == (("empty",), len(FILES) - 1)


def test_nothing_is_moved_that_is_only_asked_about(store, run, tmp_path):
    assert len(push(store.open(), run, AT, dry_run=True).moved) == len(FILES)
    assert store.contents() == {}
    push(store.open(), run, AT)
    pull(store.open(), AT, tmp_path / "back", dry_run=True)
    assert not (tmp_path / "back").exists()


@pytest.mark.parametrize("cut", [3_000, 90_000])
def test_a_wire_that_breaks_on_the_way_up_leaves_whole_objects_and_no_index(store, run, cut):
    with Wire(store.url, [cut] + [0] * 30) as wire, pytest.raises(NetworkError, match="goes on from there"):
        push(store.open(wire.url, attempts=1), run, AT)
    there = store.contents()
    assert there.items() <= {f"models/fast-car/{name}": data for name, data in FILES.items()}.items()
    assert not {"models/fast-car/job.json", "models/fast-car/checkpoints/checkpoints.json"} & set(there)
    done = push(store.open(), run, AT)
    assert set(done.moved) == {name for name in FILES if f"models/fast-car/{name}" not in there}
    assert len(store.contents()) == len(FILES)


def test_a_wire_that_breaks_on_the_way_down_leaves_whole_files_and_no_index(store, run, tmp_path):
    push(store.open(), run, AT)
    with Wire(store.url, [45_000] + [0] * 30) as wire, pytest.raises(NetworkError, match="goes on from there"):
        pull(store.open(wire.url, attempts=1), AT, tmp_path / "back")
    there = as_found(tmp_path / "back")
    assert there.items() <= FILES.items()
    assert "job.json" not in there
    pull(store.open(), AT, tmp_path / "back")
    assert as_found(tmp_path / "back") == FILES
    assert [path for path in (tmp_path / "back").rglob(".*")] == []


def test_a_wire_that_breaks_again_and_again_is_tried_again(store, run):
    with Wire(store.url, [20_000, 2_000, 50_000, 100, 30_000]) as wire:
        push(store.open(wire.url), run, AT)
        assert wire.cuts == []
    assert store.contents() == {f"models/fast-car/{name}": data for name, data in FILES.items()}


@pytest.fixture
def large(tmp_path):
    """Two parts and a half, no two alike."""
    path = tmp_path / "large.bin"
    path.write_bytes(b"".join(number.to_bytes(4, "big") for number in range(PART_BYTES * 5 // 8)))
    return path


def test_a_large_file_that_breaks_off_on_the_way_up_begins_anew(store, large):
    with Wire(store.url, [PART_BYTES + PART_BYTES // 2] + [0] * 30) as wire, pytest.raises(NetworkError):
        push(store.open(wire.url, attempts=1), large, AT)
    assert store.contents() == {}
    push(store.open(), large, AT)
    assert store.contents() == {"models/fast-car/large.bin": large.read_bytes()}
    assert push(store.open(), large, AT).moved == (), "the ETag of its parts tells that it is there"


def test_a_large_object_that_breaks_off_on_the_way_down_begins_anew(store, large, tmp_path):
    push(store.open(), large, AT)
    with Wire(store.url, [PART_BYTES + PART_BYTES // 2] + [0] * 30) as wire, pytest.raises(NetworkError):
        pull(store.open(wire.url, attempts=1), AT, tmp_path / "back")
    assert as_found(tmp_path / "back") == {}
    pull(store.open(), AT, tmp_path / "back")
    assert (tmp_path / "back" / "large.bin").read_bytes() == large.read_bytes()
    assert [path.name for path in (tmp_path / "back").iterdir()] == ["large.bin"]


def test_what_comes_with_another_sum_is_refused(moto_store, run, tmp_path, monkeypatch):
    """A store, or something on the way, that gives other bytes of the same length."""
    push(moto_store.open(), run, AT)
    store = moto_store.open()
    fetch = store._fetch

    def spoiled(bucket, key, etag, path):
        fetch(bucket, key, etag, path)
        if key.endswith("1.policy.safetensors"):
            with open(path, "r+b") as file:
                file.write(b"?")

    monkeypatch.setattr(store, "_fetch", spoiled)
    with pytest.raises(NetworkError, match=r"1\.policy\.safetensors: what came is not the object of 40000 bytes"):
        pull(store, AT, tmp_path / "back")
    assert not list((tmp_path / "back").rglob("*policy*"))
    assert not (tmp_path / "back" / "job.json").exists()


def test_a_link_is_valid_for_7_days_at_most(moto_store, run):
    import urllib.request

    push(moto_store.open(), run, AT)
    store, key = moto_store.open(), "models/fast-car/metrics.jsonl"
    week = 7 * 24 * 3600
    with urllib.request.urlopen(store.link("bucket", key, week)) as answer:
        assert answer.read() == FILES["metrics.jsonl"]
    for seconds in (week + 1, 0):
        with pytest.raises(BucketError, match=f"a link of {seconds} s; expected 1 to 604800 s, which is 7 days"):
            store.link("bucket", key, seconds)


@pytest.mark.parametrize(
    ("keys", "letter"),
    [
        (["m/good", "m/../../x"], "would leave its folder"),
        (["m/a//b", "m/good"], "holds an empty part"),
        (["m/C:evil", "m/good"], "begins like a path of a disk"),
        (["m/a\\b", "m/good"], "holds a backslash"),
        (["m/Track.npy", "m/track.npy"], "differ in case only"),
        (["m/a", "m/a/b"], "as if it were a folder"),
    ],
)
def test_a_hostile_bucket_writes_nothing(moto_url, tmp_path, keys, letter):
    store = Store(moto_url, "hostile")
    store.boto.create_bucket(Bucket="hostile")
    for key in keys:
        store.boto.put_object(Bucket="hostile", Key=key, Body=b"evil")
    try:
        with pytest.raises(BucketError, match=letter):
            pull(store.open(), Address("hostile", "m"), tmp_path / "deep" / "back")
        assert list(tmp_path.rglob("*")) == []
    finally:
        empty(store)


def test_a_folder_that_trains_is_not_written_over(moto_store, run, tmp_path):
    from racecraft.contract.errors import RunFolderError

    push(moto_store.open(), run, AT)
    (tmp_path / "busy").mkdir()
    with RunFolder(tmp_path / "busy").lock(), pytest.raises(RunFolderError, match="another training holds it"):
        pull(moto_store.open(), AT, tmp_path / "busy")


def test_links_are_not_put(moto_store, run):
    (run / "out").symlink_to("/etc")
    (run / "passwd").symlink_to("/etc/passwd")
    push(moto_store.open(), run, AT)
    assert len(moto_store.contents()) == len(FILES)
