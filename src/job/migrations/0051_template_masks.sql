-- A template's mask, as a scan's.
ALTER TABLE template ADD COLUMN mask TEXT;

DROP VIEW uploaded_blob;
CREATE VIEW uploaded_blob (digest) AS
    SELECT mesh FROM scan
    UNION SELECT landmarks FROM scan WHERE landmarks IS NOT NULL
    UNION SELECT mask FROM scan WHERE mask IS NOT NULL
    UNION SELECT texture FROM scan WHERE texture IS NOT NULL
    UNION SELECT mesh FROM template
    UNION SELECT landmarks FROM template WHERE landmarks IS NOT NULL
    UNION SELECT mask FROM template WHERE mask IS NOT NULL;

DROP VIEW registered_blob;
CREATE VIEW registered_blob (digest) AS
    SELECT output FROM step WHERE output IS NOT NULL
    UNION SELECT digest FROM result
    UNION SELECT j.value FROM registration r, json_each(r.template_parts) j WHERE length(j.value) = 64
    UNION SELECT j.value FROM child c, json_each(c.parts) j WHERE length(j.value) = 64;
