"""Which files of a folder belong to a trained model: found by hand, where several could be meant."""

from pathlib import Path

from racecraft.formats.aws.trained_model import _nearest


def test_of_several_files_of_a_name_the_one_nearest_to_the_weights_is_meant():
    weights = Path("/model/ip/agent/3_Step-9.ckpt.index")
    near, far, aside = Path("/model/ip/m.json"), Path("/model/m.json"), Path("/model/other/deep/m.json")
    for files in ([near, far, aside], [aside, far, near]):
        assert _nearest(files, {"m.json"}, weights) == near
    assert _nearest([aside, far], {"m.json"}, weights) == far, "of equals the shallowest"
    assert _nearest([near, far], {"n.json"}, weights) is None
