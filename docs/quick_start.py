#!/usr/bin/env python3
"""Registers FOLDER/NAME/scan.ply with FOLDER/NAME/landmarks.json: quick_start.py SERVER FOLDER OUT [MORE_OF_THE_REQUEST]"""
import io
import json
import os
import sys
import time
import zipfile
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import quote
from urllib.request import Request, urlopen

server, folder, out = sys.argv[1].rstrip("/"), Path(sys.argv[2]), Path(sys.argv[3])
more = json.loads(sys.argv[4]) if len(sys.argv) > 4 else {}  # such as {"vertices": 2562}
key = os.environ.get("ONEMESH_API_KEY")


def ask(method, path, body=None, media_type="application/json"):
    headers = {"Content-Type": media_type} | ({"Authorization": f"Bearer {key}"} if key else {})
    try:
        return urlopen(Request(server + path, body, headers, method=method)).read()
    except HTTPError as error:
        sys.exit(f"{method} {path}: {error.read().decode()}")


scans = []
for mesh in sorted(folder.glob("*/scan.ply")):
    name = mesh.parent.name
    scan = json.loads(ask("POST", f"/v1/scans?name={quote(name)}", mesh.read_bytes(), "model/ply"))
    ask("PUT", f"/v1/scans/{scan['id']}/landmarks", (mesh.parent / "landmarks.json").read_bytes())
    scans.append({"id": scan["id"], "name": name})

registration = json.loads(ask("POST", "/v1/registrations", json.dumps({"scans": scans} | more).encode()))
while registration["status"] in ("queued", "running"):
    print(f"{registration['status']}, {registration['progress']:.0%}")
    time.sleep(1)
    registration = json.loads(ask("GET", f"/v1/registrations/{registration['id']}"))
for child in registration["children"]:
    print(child["name"], child.get("verdict") or child.get("problem"))
if "results" not in registration:
    sys.exit(f"{registration['status']}: {registration.get('problem')}")
zipfile.ZipFile(io.BytesIO(ask("GET", registration["results"]["set"]))).extractall(out)
print(f"the set is in {out}; look at {out / 'sheet.png'}")
