"""An installation's settings, with what the shell says laid over its files."""

from racecraft.formats.aws.drfc_folder import LOADED, open_drfc_folder


def test_quotes_of_a_page_that_were_pasted_into_the_shell_are_no_part_of_a_name(tmp_path):
    (tmp_path / "run.env").write_text("DR_LOCAL_S3_MODEL_PREFIX=first\nDR_CAR_NAME=FastCar\n")
    loaded = {LOADED: open_drfc_folder(tmp_path).digest}
    pasted = {"DR_LOCAL_S3_MODEL_PREFIX": "\u201dsecond\u201d", "DR_CAR_NAME": "\u201cFastCar\u201d"}
    drfc = open_drfc_folder(tmp_path, shell=loaded | pasted)
    assert drfc.model == tmp_path / "bucket" / "second"
    assert drfc.notes == ("set in the shell, which counts before the files: DR_LOCAL_S3_MODEL_PREFIX",)
