-- Registrations, their scans and their steps. Blobs are named by their SHA-256; times are milliseconds since 1970.
CREATE TABLE registration (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    record INTEGER NOT NULL,
    name TEXT,
    owner TEXT,
    dedupe_key TEXT UNIQUE,
    status TEXT NOT NULL,
    priority INTEGER NOT NULL,
    -- What the scans are registered from, as it was asked for, and the files of it.
    template TEXT NOT NULL,
    template_parts TEXT,
    settings TEXT NOT NULL,
    webhook TEXT,
    problem TEXT,
    -- What is done, in this order; it grows when the plan is made.
    stages TEXT NOT NULL,
    -- The last stage that began.
    stage INTEGER,
    last_event INTEGER NOT NULL DEFAULT 0,
    -- Seconds of work, and where it stands among those who share the threads.
    seconds REAL NOT NULL DEFAULT 0,
    turn REAL NOT NULL,
    -- How long it is kept after its end; for ever without.
    keep INTEGER,
    created_at INTEGER NOT NULL,
    started_at INTEGER,
    finished_at INTEGER,
    expires_at INTEGER
) STRICT;
CREATE INDEX registration_status ON registration (status, priority, turn);
CREATE INDEX registration_expiry ON registration (expires_at);

CREATE TABLE child (
    registration INTEGER NOT NULL REFERENCES registration ON DELETE CASCADE,
    -- Its place in the order of names.
    place INTEGER NOT NULL,
    scan TEXT NOT NULL,
    name TEXT NOT NULL,
    parts TEXT NOT NULL,
    status TEXT NOT NULL,
    stage INTEGER,
    verdict TEXT,
    problem TEXT,
    started_at INTEGER,
    finished_at INTEGER,
    PRIMARY KEY (registration, place)
) STRICT, WITHOUT ROWID;

-- A stage of one scan, or of all where the place is -1. A waiting step is ready when none before it is open.
CREATE TABLE step (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    registration INTEGER NOT NULL REFERENCES registration ON DELETE CASCADE,
    stage INTEGER NOT NULL,
    place INTEGER NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('waiting', 'ready', 'running', 'done', 'failed', 'dropped')),
    runs INTEGER NOT NULL DEFAULT 0,
    -- How often the program ended while it ran.
    crashes INTEGER NOT NULL DEFAULT 0,
    output TEXT,
    seconds REAL,
    UNIQUE (registration, stage, place)
) STRICT;
CREATE INDEX step_state ON step (state, registration);

CREATE TABLE result (
    registration INTEGER NOT NULL REFERENCES registration ON DELETE CASCADE,
    file TEXT NOT NULL,
    digest TEXT NOT NULL,
    size INTEGER NOT NULL,
    PRIMARY KEY (registration, file)
) STRICT, WITHOUT ROWID;

CREATE TABLE event (
    registration INTEGER NOT NULL REFERENCES registration ON DELETE CASCADE,
    sequence INTEGER NOT NULL,
    at INTEGER NOT NULL,
    kind TEXT NOT NULL,
    PRIMARY KEY (registration, sequence)
) STRICT, WITHOUT ROWID;

-- Every blob that these tables name.
CREATE VIEW registered_blob (digest) AS
    SELECT output FROM step WHERE output IS NOT NULL
    UNION SELECT digest FROM result
    UNION SELECT json_extract(template_parts, '$.mesh') FROM registration WHERE template_parts IS NOT NULL
    UNION SELECT json_extract(template_parts, '$.landmarks') FROM registration
        WHERE json_extract(template_parts, '$.landmarks') IS NOT NULL
    UNION SELECT json_extract(parts, '$.mesh') FROM child
    UNION SELECT json_extract(parts, '$.landmarks') FROM child WHERE json_extract(parts, '$.landmarks') IS NOT NULL
    UNION SELECT json_extract(parts, '$.mask') FROM child WHERE json_extract(parts, '$.mask') IS NOT NULL
    UNION SELECT json_extract(parts, '$.texture') FROM child WHERE json_extract(parts, '$.texture') IS NOT NULL;
