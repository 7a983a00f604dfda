"""Scenes on their way to a worker: what arrives is what was sent, each content once."""

import pickle

import numpy as np

from relume.cluster.serialization import pack, unpack
from relume.fingerprint import content_hash
from relume.translator.scene_values import Matrix, Mesh, Picture


def test_what_arrives_is_what_was_sent(tmp_path):
    file = tmp_path / "part.obj"
    file.write_bytes(b"v 0 0 0\n")
    array = np.arange(12.0).reshape(4, 3)
    scene = {
        "type": "scene",
        "sensor": {"to_world": Matrix.of(np.eye(4)), "fov": 30.0, "crop": (1, 2)},
        "a": {"type": "mesh", "mesh": Mesh(array, array.astype(int), colors=array)},
        "b": {"type": "obj", "filename": str(file)},
        "c": {"type": "bitmap", "picture": Picture(array.astype(np.float32)), "values": [1, "x"]},
    }
    before = content_hash(scene)
    packed, contents = pack(scene)
    assert len(contents) == 4  # vertices and colours are one
    assert len(pickle.dumps(packed)) < 2000
    file.unlink()
    (tmp_path / "there").mkdir()
    arrived = unpack(pickle.loads(pickle.dumps(packed)), contents, tmp_path / "there")
    assert content_hash(arrived) == before
    assert arrived["b"]["filename"].endswith(".obj")
