-- What was uploaded. Meshes and all other files are blobs, named here by their SHA-256; times are milliseconds since 1970.
CREATE TABLE scan (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    record INTEGER NOT NULL,
    name TEXT,
    format TEXT NOT NULL,
    mesh TEXT NOT NULL,
    landmarks TEXT,
    mask TEXT,
    texture TEXT,
    size INTEGER NOT NULL,
    report TEXT NOT NULL,
    created_at INTEGER NOT NULL,
    expires_at INTEGER
) STRICT;
CREATE INDEX scan_expiry ON scan (expires_at);

CREATE TABLE template (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    record INTEGER NOT NULL,
    name TEXT,
    format TEXT NOT NULL,
    mesh TEXT NOT NULL,
    landmarks TEXT,
    size INTEGER NOT NULL,
    figures TEXT NOT NULL,
    created_at INTEGER NOT NULL
) STRICT;

-- Every blob that these tables name.
CREATE VIEW uploaded_blob (digest) AS
    SELECT mesh FROM scan
    UNION SELECT landmarks FROM scan WHERE landmarks IS NOT NULL
    UNION SELECT mask FROM scan WHERE mask IS NOT NULL
    UNION SELECT texture FROM scan WHERE texture IS NOT NULL
    UNION SELECT mesh FROM template
    UNION SELECT landmarks FROM template WHERE landmarks IS NOT NULL;

CREATE TABLE api_key (
    id TEXT PRIMARY KEY,
    name TEXT NOT NULL,
    secret_sha256 TEXT NOT NULL,
    scope TEXT NOT NULL CHECK (scope IN ('read', 'write')),
    created_at INTEGER NOT NULL,
    revoked_at INTEGER
) STRICT;

-- Answers to POST requests with an Idempotency-Key; one without status is under way.
CREATE TABLE idempotency_key (
    owner TEXT NOT NULL,
    key TEXT NOT NULL,
    request TEXT NOT NULL,
    body TEXT,
    status INTEGER,
    headers TEXT,
    answer BLOB,
    created_at INTEGER NOT NULL,
    PRIMARY KEY (owner, key)
) STRICT;
CREATE INDEX idempotency_key_age ON idempotency_key (created_at);
