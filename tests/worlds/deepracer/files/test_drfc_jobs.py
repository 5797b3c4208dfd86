"""What an installation notes of its jobs, by run id and kind."""

import pytest

from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING, BookError, RecordedJob, job_of, record_job

FIRST, LATER = RecordedJob("train-1", "bucket/m"), RecordedJob("train-2", "bucket/m-2")


def test_the_latest_of_each_kind_and_run_id_is_known(tmp_path):
    assert job_of(tmp_path, 0, TRAINING) is None
    record_job(tmp_path, 0, TRAINING, FIRST)
    record_job(tmp_path, 0, EVALUATION, RecordedJob("judge-1", "bucket/m"))
    record_job(tmp_path, 0, TRAINING, LATER)
    record_job(tmp_path, 3, TRAINING, FIRST)
    assert job_of(tmp_path, 0, TRAINING) == LATER
    assert job_of(tmp_path, 0, EVALUATION) == RecordedJob("judge-1", "bucket/m")
    assert (job_of(tmp_path, 3, TRAINING), job_of(tmp_path, 3, EVALUATION)) == (FIRST, None)


@pytest.mark.parametrize("text", ['{"training": {"job": "a"}}', "{"])
def test_a_damaged_note_is_refused_by_name(tmp_path, text):
    record_job(tmp_path, 0, EVALUATION, FIRST)
    (tmp_path / ".racecraft" / "run-0.json").write_text(text)
    with pytest.raises(BookError, match=r"run-0\.json"):
        job_of(tmp_path, 0, TRAINING)
