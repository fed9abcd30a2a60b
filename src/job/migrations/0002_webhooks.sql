-- What was told, or is still to be told, of ended registrations; those that are deleted are not told again.
CREATE TABLE webhook_delivery (
    registration TEXT PRIMARY KEY,
    message TEXT NOT NULL UNIQUE,
    url TEXT NOT NULL,
    failed INTEGER NOT NULL,
    next_at INTEGER NOT NULL,
    ended_at INTEGER
) STRICT;
CREATE INDEX webhook_delivery_next ON webhook_delivery (next_at) WHERE ended_at IS NULL;

CREATE TABLE setting (
    name TEXT PRIMARY KEY,
    value TEXT NOT NULL
) STRICT;
