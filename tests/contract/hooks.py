"""What schemathesis cannot know from the document: what files look like inside."""

import io
import json
import math
import struct
import zipfile
import zlib

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


def png(size):
    """A white disc, transparent around it."""
    def pixel(x, y):
        return b"\xff\xff\xff\xff" if math.hypot(x + 0.5 - size / 2, y + 0.5 - size / 2) < size / 4 else bytes(4)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + b"".join(pixel(x, y) for x in range(size)) for y in range(size))
    head = struct.pack(">IIBBBBB", size, size, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def frame(k, views, size):
    """A camera on the horizon that looks at the origin, in OpenGL's axes."""
    c, s = math.cos(2 * math.pi * k / views), math.sin(2 * math.pi * k / views)
    matrix = [[c, 0, s, 4 * s], [0, 1, 0, 0], [-s, 0, c, 4 * c], [0, 0, 0, 1]]
    return {"file_path": f"images/{k}.png", "w": size, "h": size, "fl_x": size, "fl_y": size,
            "cx": size / 2, "cy": size / 2, "transform_matrix": matrix}


def zipped(height, size=16, views=4):
    """A mesh and a capture at once: what is not asked for is left packed."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("scan.obj", OBJ.format(height))
        archive.writestr("transforms.json", json.dumps({"frames": [frame(k, views, size) for k in range(views)]}))
        for k in range(views):
            archive.writestr(f"images/{k}.png", png(size))
    return file.getvalue()


heights = st.integers(-100, -1)
schemathesis.openapi.media_type("model/obj", heights.map(lambda z: OBJ.format(z).encode()))
schemathesis.openapi.media_type("model/ply", heights.map(lambda z: ply(z).encode()))
schemathesis.openapi.media_type("application/zip", heights.map(zipped))
