use std::net::SocketAddr;
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};
use bytes::Bytes;
use futures_util::future::join_all;
use http_body_util::{BodyExt, Empty};
use hyper::Request;
use hyper::client::conn::http1::{SendRequest, handshake};
use hyper_util::rt::TokioIo;
use onemesh::http::Service;
use onemesh::http::config::Config;
use onemesh::job::registration::{NewMember, NewRegistration};
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::time::MissedTickBehavior;
use tokio_util::sync::CancellationToken;

use super::clock::{median, row};
use super::sculpt;
use super::service::Bed;

/// Between two requests of one client.
const PERIOD: Duration = Duration::from_secs(1);
/// Registrations that run meanwhile, and scans of each.
const REGISTRATIONS: usize = 2;
const SCANS: usize = 3;
/// Triangles of a scan.
const TRIANGLES: usize = 60_000;
/// How often that is done, without clients and with them in turn.
const ROUNDS: usize = 5;
/// How long it goes on at most.
const LONGEST: Duration = Duration::from_secs(300);

/// So many clients of a server on this machine, each of which asks once a second how a registration stands, every other of
/// which follows its events too: how long answers take, and how much longer the registrations take than without them.
pub fn clients(count: usize) -> anyhow::Result<()> {
    let heads = sculpt(SCANS, TRIANGLES);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    // Of their own, so that it is the server's threads that answers wait for.
    let of_clients = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("clients")
        .enable_all()
        .build()?;
    runtime.block_on(async {
        let folder = tempfile::tempdir()?;
        let mut config = Config::default();
        config.server.listen.set_port(0);
        config.data.folder = folder.path().join("data");
        config.data.keep_free_bytes = 0;
        (config.limits.requests.per_second, config.limits.requests.burst) = (1_000_000, 1_000_000);
        let service = Service::open(config).await?;
        let (address, bed) = (service.address(), Bed::of(service.app()));
        let (stop, stopped) = oneshot::channel::<()>();
        let server = tokio::spawn(service.run(async move { drop(stopped.await) }));
        let members = bed.upload(&heads).await?;
        // The first time reads the scans.
        together(&bed, &members).await?.wait(&bed).await?;
        let mut found = Found::default();
        for _ in 0..ROUNDS {
            found.alone.push(together(&bed, &members).await?.wait(&bed).await?);
            let run = together(&bed, &members).await?;
            let ending = CancellationToken::new();
            let paths: Vec<String> = run.ids.iter().map(|id| format!("/v1/registrations/{id}")).collect();
            let crowd = of_clients.spawn(crowd(count, address, paths, ending.clone()));
            found.crowded.push(run.wait(&bed).await?);
            ending.cancel();
            found.latencies.extend(crowd.await??);
        }
        drop(stop);
        server.await?;
        found.tell(count);
        anyhow::Ok(())
    })?;
    of_clients.shutdown_background();
    Ok(())
}

/// Registrations that were asked for at the same time.
struct Together {
    start: Instant,
    ids: Vec<String>,
    waiting: Vec<onemesh::job::registration::RegistrationId>,
}

async fn together(bed: &Bed, members: &[NewMember]) -> anyhow::Result<Together> {
    let start = Instant::now();
    let mut waiting = Vec::new();
    for _ in 0..REGISTRATIONS {
        let scans = members.to_vec();
        waiting.push(bed.jobs.submit(NewRegistration { scans, ..NewRegistration::default() }).await?.id);
    }
    Ok(Together { start, ids: waiting.iter().map(ToString::to_string).collect(), waiting })
}

impl Together {
    async fn wait(self, bed: &Bed) -> anyhow::Result<Duration> {
        let all = async {
            for id in &self.waiting {
                bed.ended(id).await?;
            }
            anyhow::Ok(self.start.elapsed())
        };
        let took = tokio::time::timeout(LONGEST, all).await.context("the registrations take too long")??;
        for id in &self.waiting {
            bed.jobs.delete(id).await?;
        }
        Ok(took)
    }
}

async fn crowd(
    count: usize,
    address: SocketAddr,
    paths: Vec<String>,
    ending: CancellationToken,
) -> anyhow::Result<Vec<Duration>> {
    let client = |k: usize| {
        let (path, ending) = (paths[k % paths.len()].clone(), ending.clone());
        let first = PERIOD.mul_f64(k as f64 / count as f64);
        tokio::spawn(async move {
            tokio::time::sleep(first).await;
            if k.is_multiple_of(2) {
                tokio::spawn(follow(address, format!("{path}/events"), ending.clone()));
            }
            poll(address, &path, &ending).await
        })
    };
    let all = join_all((0..count).map(client)).await;
    let mut latencies = Vec::new();
    for own in all {
        latencies.extend(own??);
    }
    Ok(latencies)
}

/// How long each answer took, to its last byte.
async fn poll(address: SocketAddr, path: &str, ending: &CancellationToken) -> anyhow::Result<Vec<Duration>> {
    let mut connection = connect(address).await?;
    let mut ticks = tokio::time::interval(PERIOD);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut latencies = Vec::new();
    loop {
        tokio::select! {
            _ = ticks.tick() => {}
            () = ending.cancelled() => return Ok(latencies),
        }
        let start = Instant::now();
        let answer = connection.send_request(request(address, path)?).await?;
        let status = answer.status();
        answer.into_body().collect().await?;
        // It is deleted when all have been measured.
        if ending.is_cancelled() {
            return Ok(latencies);
        }
        ensure!(status == 200 || status == 404, "{path}: {status}");
        latencies.push(start.elapsed());
    }
}

async fn follow(address: SocketAddr, path: String, ending: CancellationToken) -> anyhow::Result<()> {
    let mut connection = connect(address).await?;
    let mut events = connection.send_request(request(address, &path)?).await?.into_body();
    loop {
        tokio::select! {
            event = events.frame() => match event {
                Some(event) => drop(event?),
                None => return Ok(()),
            },
            () = ending.cancelled() => return Ok(()),
        }
    }
}

async fn connect(address: SocketAddr) -> anyhow::Result<SendRequest<Empty<Bytes>>> {
    let (sender, connection) = handshake(TokioIo::new(TcpStream::connect(address).await?)).await?;
    tokio::spawn(connection);
    Ok(sender)
}

fn request(address: SocketAddr, path: &str) -> anyhow::Result<Request<Empty<Bytes>>> {
    Ok(Request::get(path).header("host", address.to_string()).body(Empty::new())?)
}

/// How long the registrations took in each round, and all answers.
#[derive(Default)]
struct Found {
    alone: Vec<Duration>,
    crowded: Vec<Duration>,
    latencies: Vec<Duration>,
}

impl Found {
    fn tell(mut self, count: usize) {
        let loss = 100.0 * (1.0 - median(&self.alone).as_secs_f64() / median(&self.crowded).as_secs_f64());
        row(&format!("{REGISTRATIONS} registrations of {SCANS} scans, alone"), &self.alone);
        row(&format!("- with {count} clients: {loss:.1} % of the work's speed is lost"), &self.crowded);
        if self.latencies.is_empty() {
            return;
        }
        self.latencies.sort_unstable();
        let last = self.latencies.len() - 1;
        let at = |share: f64| self.latencies[(last as f64 * share) as usize].as_secs_f64() * 1e3;
        say!(
            "\n{} answers: median {:.1} ms, p99 {:.1} ms, longest {:.1} ms",
            self.latencies.len(),
            at(0.5),
            at(0.99),
            at(1.0)
        );
    }
}
