-- What a host knows. Values that only travel (descriptions, problems, phases) are JSON; the views
-- below give what is in them as rows, so that everything can be asked in SQL.

CREATE TABLE host (
    name      TEXT NOT NULL,
    revision  INTEGER NOT NULL,
    stopped   INTEGER NOT NULL DEFAULT 0 -- 1: the daemon that wrote it was told to end
) STRICT;

CREATE TABLE drives (
    id          TEXT PRIMARY KEY,
    kind        TEXT NOT NULL,
    root        TEXT NOT NULL,
    node        TEXT,
    filesystem  TEXT NOT NULL,
    state       TEXT NOT NULL,
    since       TEXT NOT NULL,           -- JSON [monotonic_s, wall_s]
    problems    TEXT NOT NULL,           -- JSON
    mark        TEXT NOT NULL DEFAULT ''
) STRICT;

CREATE TABLE payloads (
    key         TEXT PRIMARY KEY,
    digest      TEXT NOT NULL,
    payload_id  TEXT NOT NULL,
    version     TEXT NOT NULL,
    release     INTEGER NOT NULL,
    fleet       TEXT NOT NULL,
    step        TEXT NOT NULL,
    phases      TEXT NOT NULL,           -- JSON {phase: [monotonic_s, wall_s]}
    components  TEXT NOT NULL,           -- JSON, by their names on this host
    renamed     TEXT NOT NULL DEFAULT '{}', -- JSON {id in its manifest: name}, where they differ
    problems    TEXT NOT NULL,           -- JSON
    was         INTEGER NOT NULL DEFAULT 0 -- the release that it took over from
) STRICT;

CREATE TABLE sources (
    payload   TEXT NOT NULL REFERENCES payloads (key) ON DELETE CASCADE,
    position  INTEGER NOT NULL,          -- the first is copied from
    drive     TEXT NOT NULL,
    folder    TEXT NOT NULL,
    PRIMARY KEY (payload, drive)
) STRICT;

CREATE TABLE components (
    id             TEXT PRIMARY KEY,
    payload        TEXT NOT NULL REFERENCES payloads (key) ON DELETE CASCADE,
    payload_id     TEXT NOT NULL,
    distribution   TEXT NOT NULL,
    entry_point    TEXT NOT NULL,
    version        TEXT NOT NULL,
    state          TEXT NOT NULL,
    description    TEXT NOT NULL,        -- JSON, as the plugin says
    venv           TEXT NOT NULL,
    site_packages  TEXT NOT NULL,
    scratch        TEXT NOT NULL,
    rank           INTEGER NOT NULL,
    permissions    TEXT NOT NULL,        -- JSON
    settings       TEXT NOT NULL,        -- JSON
    problems       TEXT NOT NULL         -- JSON
) STRICT;

CREATE TABLE claims (
    component     TEXT NOT NULL REFERENCES components (id) ON DELETE CASCADE,
    position      INTEGER NOT NULL,
    name          TEXT NOT NULL,
    match         TEXT NOT NULL,         -- JSON
    optional      INTEGER NOT NULL,
    device        TEXT REFERENCES devices (id),
    contested_by  TEXT NOT NULL,         -- JSON
    nodes         TEXT NOT NULL DEFAULT '[]', -- JSON, those of the device that serve it
    PRIMARY KEY (component, name)
) STRICT;

CREATE TABLE devices (                   -- physical ones that are there
    id       TEXT PRIMARY KEY,           -- bus and port, or the name of a slot file
    bus      TEXT NOT NULL,
    port     TEXT NOT NULL,
    parent   TEXT NOT NULL,              -- id of what it is plugged into, or empty
    driver   TEXT NOT NULL,
    vendor   TEXT NOT NULL,
    product  TEXT NOT NULL,
    serial   TEXT NOT NULL,
    name     TEXT NOT NULL,
    first_s  REAL NOT NULL,
    since_s  REAL NOT NULL
) STRICT;

CREATE TABLE device_interfaces (
    device    TEXT NOT NULL REFERENCES devices (id) ON DELETE CASCADE,
    position  INTEGER NOT NULL,
    number    TEXT NOT NULL,
    kind      TEXT NOT NULL,             -- class:subclass:protocol
    driver    TEXT NOT NULL,
    PRIMARY KEY (device, position)
) STRICT;

CREATE TABLE device_nodes (
    device      TEXT NOT NULL REFERENCES devices (id) ON DELETE CASCADE,
    position    INTEGER NOT NULL,
    node        TEXT NOT NULL,
    interface   TEXT NOT NULL,           -- number of an interface, or empty
    properties  TEXT NOT NULL,           -- JSON
    PRIMARY KEY (device, position)
) STRICT;

CREATE TABLE known_devices (             -- those that were ever here, as far as is remembered
    identity  TEXT PRIMARY KEY,
    name      TEXT NOT NULL,
    device    TEXT NOT NULL,             -- id when last seen
    first_s   REAL NOT NULL,
    last_s    REAL NOT NULL
) STRICT;

CREATE TABLE mounts (
    unit    TEXT PRIMARY KEY,
    pose    TEXT NOT NULL,               -- JSON [x, y, z, roll, pitch, yaw]
    origin  TEXT NOT NULL
) STRICT;

CREATE TABLE connections (               -- what people have said optional inputs are to get
    input   TEXT PRIMARY KEY,            -- component.unit.slot
    stream  TEXT NOT NULL
) STRICT;

CREATE TABLE highwater (                 -- never pruned
    payload_id  TEXT PRIMARY KEY,
    release     INTEGER NOT NULL,        -- the newest, for whatever fleet
    digest      TEXT NOT NULL,
    owner       TEXT NOT NULL            -- role by which it was the first to come in
) STRICT;

CREATE TABLE names (                     -- what has another name than its own
    payload_id  TEXT PRIMARY KEY,
    components  TEXT NOT NULL,           -- JSON {id in its manifest: name}
    plugins     TEXT NOT NULL            -- JSON {distribution: name}
) STRICT;

CREATE TABLE rollbacks (                 -- earlier releases that people went back to
    payload_id  TEXT PRIMARY KEY,
    digest      TEXT NOT NULL,
    release     INTEGER NOT NULL,
    below       INTEGER NOT NULL
) STRICT;

CREATE TABLE goals (                     -- those that are not over
    id        TEXT PRIMARY KEY,
    text      TEXT NOT NULL,
    pddl      TEXT NOT NULL,
    kind      TEXT NOT NULL,
    priority  INTEGER NOT NULL
) STRICT;

CREATE TABLE former (                    -- payloads that were active and are gone
    payload_id   TEXT PRIMARY KEY,
    version      TEXT NOT NULL,
    components   TEXT NOT NULL,          -- JSON {component: description}
    left_wall_s  REAL NOT NULL
) STRICT;

CREATE TABLE tries (                     -- what daemons were at when they died, and how often
    subject  TEXT PRIMARY KEY,           -- drive or payload key
    deaths   INTEGER NOT NULL
) STRICT;

CREATE TABLE journal (
    id           INTEGER PRIMARY KEY AUTOINCREMENT,
    monotonic_s  REAL NOT NULL,
    wall_s       REAL NOT NULL,
    boot         TEXT NOT NULL,
    event        TEXT NOT NULL,
    subject      TEXT NOT NULL,
    step         TEXT NOT NULL,
    problems     TEXT NOT NULL,          -- JSON
    detail       TEXT NOT NULL           -- JSON
) STRICT;

CREATE INDEX journal_by_subject ON journal (subject, id);

CREATE TRIGGER journal_is_never_changed BEFORE UPDATE ON journal
BEGIN SELECT RAISE(ABORT, 'the journal is append-only'); END;

CREATE TRIGGER journal_is_never_deleted BEFORE DELETE ON journal
WHEN old.id > (SELECT max(id) FROM journal) - 1000 -- only what is long past is let go
BEGIN SELECT RAISE(ABORT, 'the journal is append-only'); END;

CREATE VIEW behaviours AS
SELECT c.id AS component, b.value ->> 'name' AS name, b.value ->> 'action' AS action,
       b.value ->> 'lasting' AS lasting, b.value -> 'phrases' AS phrases
FROM components AS c, json_each(c.description, '$.behaviours') AS b;

CREATE VIEW conditions AS
SELECT c.id AS component, d.value ->> 'name' AS name, d.value -> 'predicates' AS predicates
FROM components AS c, json_each(c.description, '$.conditions') AS d;

CREATE VIEW fragments AS
SELECT c.id AS component, f.value ->> 'name' AS name, f.value ->> 'text' AS text
FROM components AS c, json_each(c.description, '$.fragments') AS f;

CREATE VIEW units AS
SELECT host.name || '__' || c.id || '__' || (u.value ->> 'name') AS unit, c.id AS component,
       u.value ->> 'name' AS name, u.value ->> 'type' AS type
FROM host, components AS c, json_each(c.description, '$.units') AS u;

CREATE VIEW streams AS
SELECT host.name || '__' || c.id || '__' || (o.value ->> 'name') AS stream, c.id AS component,
       u.value ->> 'name' AS unit, o.value ->> 'type' AS type
FROM host, components AS c, json_each(c.description, '$.units') AS u,
     json_each(u.value, '$.outputs') AS o;

CREATE VIEW phrases AS
SELECT c.id AS component, p.value ->> 'pattern' AS pattern, p.value ->> 'goal' AS goal
FROM components AS c, json_each(c.description, '$.phrases') AS p;

CREATE VIEW labels AS
SELECT c.id AS component, l.value ->> 'object' AS object, l.value ->> 'words' AS words
FROM components AS c, json_each(c.description, '$.labels') AS l;
