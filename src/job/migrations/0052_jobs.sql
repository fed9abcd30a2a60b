-- Registrations are one kind of job.
DROP VIEW registered_blob;
ALTER TABLE registration RENAME TO job;
ALTER TABLE job ADD COLUMN kind TEXT NOT NULL DEFAULT 'registration';
ALTER TABLE job RENAME COLUMN template_parts TO parts;
ALTER TABLE child RENAME COLUMN registration TO job;
ALTER TABLE step RENAME COLUMN registration TO job;
ALTER TABLE result RENAME COLUMN registration TO job;
ALTER TABLE event RENAME COLUMN registration TO job;
ALTER TABLE webhook_delivery RENAME COLUMN registration TO job;

CREATE VIEW job_blob (digest) AS
    SELECT output FROM step WHERE output IS NOT NULL
    UNION SELECT digest FROM result
    UNION SELECT p.value FROM job j, json_tree(j.parts) p WHERE p.type = 'text' AND length(p.value) = 64
    UNION SELECT p.value FROM child c, json_each(c.parts) p WHERE length(p.value) = 64;

ALTER TABLE webhook_delivery ADD COLUMN kind TEXT NOT NULL DEFAULT 'registration';
