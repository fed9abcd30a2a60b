//! Connections as they come in, each with a limited time for the head of a request.

use std::net::SocketAddr;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::{ConnectInfo, Request};
use axum::serve::Listener;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::server::graceful::GracefulShutdown;
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;

/// Bytes of a request that are held at once, its head or a piece of its body: of every upload several pieces wait to be
/// written.
const BUFFERED: usize = 64 << 10;

/// Answers by `routes` until `stopping`, then lets requests under way end. A client that has not sent a request's head
/// within `patience`, the first or a later one, is hung up on: it would hold its connection for nothing.
pub async fn serve(
    mut listener: TcpListener,
    routes: Router,
    patience: Duration,
    stopping: CancellationToken,
) {
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(patience).max_buf_size(BUFFERED);
    let open = GracefulShutdown::new();
    loop {
        // What keeps it from accepting, as too many open files, is waited out within.
        let (stream, peer): (TcpStream, SocketAddr) = tokio::select! {
            accepted = Listener::accept(&mut listener) => accepted,
            () = stopping.cancelled() => break,
        };
        let routes = TowerToHyperService::new(routes.clone());
        let answer = service_fn(move |mut request: Request<Incoming>| {
            request.extensions_mut().insert(ConnectInfo(peer));
            routes.call(request.map(Body::new))
        });
        let connection = open.watch(server.serve_connection(TokioIo::new(stream), answer));
        tokio::spawn(async move {
            if let Err(error) = connection.await {
                tracing::debug!(%peer, %error, "a connection broke off");
            }
        });
    }
    // Nobody else is let in meanwhile.
    drop(listener);
    open.shutdown().await;
}
