use std::io::{BufRead, BufReader, Read};
use std::time::Duration;

use onemesh::pipeline::Verdict;
use serde::Deserialize;

use super::failure::Failure;
use super::registration::{Reason, Registration, Status, path_of};
use super::request::{Client, header_of};

/// Bytes of a line of events, at most.
const LINE: u64 = 1 << 20;
/// How often is asked where events do not come through.
const POLL: Duration = Duration::from_secs(1);

/// What happened to a registration.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Happening {
    /// A stage began.
    Stage {
        /// Its name.
        stage: String,
    },
    /// Work moved on.
    Progress {
        /// Share of the whole.
        progress: f64,
        /// The scan's id.
        scan: String,
        /// What is done to it.
        stage: String,
        /// Share of that.
        stage_progress: f64,
    },
    /// A scan came to its end.
    Child {
        /// The scan's id.
        scan: String,
        /// How.
        status: Status,
        /// Whether its result can be used.
        verdict: Option<Verdict>,
        /// Why it failed.
        problem: Option<Reason>,
    },
    /// Something else.
    #[serde(other)]
    Other,
}

/// Who is told of a registration's way.
pub trait Watcher {
    /// Something happened.
    fn happened(&mut self, happening: &Happening);
    /// It stands so; told where events may have been missed.
    fn stands(&mut self, registration: &Registration);
}

/// An event as it comes.
#[derive(Debug, Default, PartialEq, Eq)]
struct Event {
    id: Option<u64>,
    data: String,
}

/// Follows a registration to its end.
///
/// By its events; where the connection breaks, from the last of them on; where events do not come through at all, by
/// asking every second.
///
/// # Errors
/// [`Failure`].
pub fn watch(client: &Client, id: &str, watcher: &mut impl Watcher) -> Result<Registration, Failure> {
    let mut last = 0;
    let mut silent = false;
    loop {
        if !silent {
            let before = last;
            silent = follow(client, id, &mut last, watcher)? == Stream::Silent && before == last;
        }
        let registration: Registration = client.get_json(&path_of(id))?;
        if registration.status.is_final() {
            return Ok(registration);
        }
        watcher.stands(&registration);
        std::thread::sleep(POLL);
    }
}

/// How a stream of events was.
#[derive(Debug, PartialEq, Eq)]
enum Stream {
    /// Something came, or the connection broke.
    Alive,
    /// The server gives none, or something on the way holds them back.
    Silent,
}

/// Reads events until the stream ends or breaks.
fn follow(client: &Client, id: &str, last: &mut u64, watcher: &mut impl Watcher) -> Result<Stream, Failure> {
    let after = last.to_string();
    let path = format!("{}/events", path_of(id));
    let answer = client.listen(&path, &[("accept", "text/event-stream"), ("last-event-id", &after)]);
    let answer = match answer {
        Ok(answer) if is_events(header_of(&answer, "content-type")) => answer,
        Ok(_) => return Ok(Stream::Silent),
        Err(failure) if failure.passes() => return Ok(Stream::Alive),
        Err(failure) => return Err(failure),
    };
    let mut reader = BufReader::new(answer.into_body().into_reader());
    let mut something = false;
    while let Ok(Some(event)) = next_event(&mut reader) {
        something = true;
        *last = event.id.unwrap_or(*last);
        if let Ok(happening) = serde_json::from_str(&event.data) {
            watcher.happened(&happening);
        }
    }
    Ok(if something { Stream::Alive } else { Stream::Silent })
}

fn is_events(content_type: Option<&str>) -> bool {
    content_type.is_some_and(|found| found.starts_with("text/event-stream"))
}

/// The next event with data, or none at the stream's end.
fn next_event(reader: &mut impl BufRead) -> std::io::Result<Option<Event>> {
    let mut event = Event::default();
    loop {
        let mut line = Vec::new();
        reader.by_ref().take(LINE).read_until(b'\n', &mut line)?;
        if line.is_empty() {
            return Ok(None);
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim_end_matches(['\n', '\r']);
        if line.is_empty() && !event.data.is_empty() {
            return Ok(Some(event));
        }
        let (field, value) = line.split_once(':').unwrap_or((line, ""));
        let value = value.strip_prefix(' ').unwrap_or(value);
        match field {
            "id" => event.id = value.parse().ok(),
            "data" => event.data.push_str(value),
            // The data says its name again; comments keep the connection alive.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn events_as_they_are_written() {
        let text = ": hello\n\nevent: stage\nid: 3\ndata: {\"at\":\"2026-03-01T12:00:01Z\",\"event\":\"stage\",\"stage\":\"fit\"}\n\n\
            :\n\nid:4\r\ndata:{\"event\":\"new\"}\r\n\r\ndata: cut";
        let mut reader = text.as_bytes();
        let first = next_event(&mut reader).unwrap().unwrap();
        assert_eq!(first.id, Some(3));
        let happening = serde_json::from_str(&first.data).unwrap();
        assert!(matches!(happening, Happening::Stage { stage } if stage == "fit"));
        let second = next_event(&mut reader).unwrap().unwrap();
        assert_eq!(second.id, Some(4));
        assert!(matches!(serde_json::from_str(&second.data).unwrap(), Happening::Other));
        assert_eq!(next_event(&mut reader).unwrap(), None);
    }

    /// Gives these answers, one a connection, to whoever asks.
    fn server_of(answers: Vec<String>) -> Client {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        std::thread::spawn(move || {
            for answer in answers {
                let (mut stream, _) = listener.accept().unwrap();
                let mut asked = BufReader::new(stream.try_clone().unwrap()).lines();
                while asked.next().is_some_and(|line| !line.unwrap().is_empty()) {}
                stream.write_all(answer.as_bytes()).unwrap();
            }
        });
        Client::new(url.parse().unwrap(), None, Duration::from_secs(5))
    }

    #[derive(Default)]
    struct Heard {
        stages: Vec<String>,
        stands: Vec<f64>,
    }

    impl Watcher for Heard {
        fn happened(&mut self, happening: &Happening) {
            if let Happening::Stage { stage } = happening {
                self.stages.push(stage.clone());
            }
        }

        fn stands(&mut self, registration: &Registration) {
            self.stands.push(registration.progress);
        }
    }

    fn answer(media_type: &str, body: &str) -> String {
        let length = body.len();
        format!(
            "HTTP/1.1 200 OK\r\nContent-Type: {media_type}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
        )
    }

    fn registration(status: &str, progress: f64) -> String {
        let body = serde_json::json!({ "id": "7", "status": status, "progress": progress, "children": [] });
        answer("application/json", &body.to_string())
    }

    #[test]
    fn where_no_events_come_it_is_asked() {
        let page = answer("text/html", "a proxy that knows no events");
        let running = registration("running", 0.5);
        let client = server_of(vec![page, running.clone(), running, registration("succeeded", 1.0)]);
        let mut heard = Heard::default();
        let ended = watch(&client, "7", &mut heard).unwrap();
        assert_eq!((ended.status, heard.stands), (Status::Succeeded, vec![0.5, 0.5]));
    }

    #[test]
    fn events_that_break_off_are_heard_on() {
        let event = |id: u64, stage: &str| {
            format!("id: {id}\ndata: {{\"event\": \"stage\", \"stage\": \"{stage}\"}}\n\n")
        };
        let cut = answer("text/event-stream", &(event(1, "fit") + "id: 2\ndata: {"));
        let whole = answer("text/event-stream", &event(2, "register"));
        let client =
            server_of(vec![cut, registration("running", 0.5), whole, registration("succeeded", 1.0)]);
        let mut heard = Heard::default();
        watch(&client, "7", &mut heard).unwrap();
        assert_eq!(heard.stages, ["fit", "register"]);
    }
}
