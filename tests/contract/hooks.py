"""What schemathesis cannot know from the document: what files look like inside."""

import json

import schemathesis
from hypothesis import strategies as st

OBJ = "v 0 0 {0}\nv 20 0 0\nv 0 20 0\nv 0 0 20\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
LANDMARKS = {"a": [0, 0, 0], "b": [20, 0, 0], "c": [0, 20, 0]}


def ply(height):
    corners = [(0, 0, height), (20, 0, 0), (0, 20, 0), (0, 0, 20)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    return head + "".join("%d %d %d\n" % c for c in corners) + "".join("3 %d %d %d\n" % f for f in faces)


heights = st.integers(-100, -1)
schemathesis.openapi.media_type("model/obj", heights.map(lambda z: OBJ.format(z).encode()))
schemathesis.openapi.media_type("model/ply", heights.map(lambda z: ply(z).encode()))
