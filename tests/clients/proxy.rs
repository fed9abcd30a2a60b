use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Something between client and server that breaks every connection after so many bytes of answers.
pub struct Proxy {
    /// `http://HOST:PORT`.
    pub url: String,
    broken: Arc<AtomicUsize>,
}

impl Proxy {
    /// One before `server`.
    pub fn before(server: &str, bytes: usize) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let url = format!("http://{}", listener.local_addr().unwrap());
        let broken = Arc::new(AtomicUsize::new(0));
        let (server, count) = (server.trim_start_matches("http://").to_owned(), broken.clone());
        thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                let Ok(server) = TcpStream::connect(&server) else { continue };
                let (from_client, to_server) = (client.try_clone().unwrap(), server.try_clone().unwrap());
                thread::spawn(move || pass(from_client, to_server, usize::MAX));
                let count = count.clone();
                thread::spawn(move || {
                    count.fetch_add(usize::from(pass(server, client, bytes)), Ordering::Relaxed)
                });
            }
        });
        Self { url, broken }
    }

    /// How many connections were broken.
    pub fn broken(&self) -> usize {
        self.broken.load(Ordering::Relaxed)
    }
}

/// Passes bytes on until one side ends, or `left` of them; says whether the connection was broken.
fn pass(mut from: TcpStream, mut to: TcpStream, mut left: usize) -> bool {
    let mut piece = vec![0; 8192];
    loop {
        let most = piece.len().min(left);
        let count = from.read(&mut piece[..most]).unwrap_or(0);
        left -= count;
        let ended = count == 0 || to.write_all(&piece[..count]).is_err();
        if ended || left == 0 {
            let _ = from.shutdown(Shutdown::Both);
            let _ = to.shutdown(Shutdown::Both);
            return !ended;
        }
    }
}
