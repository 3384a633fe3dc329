//! A daemon under attack, and who watches it meanwhile.

use std::net::SocketAddr;
use std::time::Duration;

use mrol::wire::transport::STREAM_WINDOW_BYTES;
use tempfile::TempDir;
use tokio::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

use crate::honest::Honest;
use crate::probe::Probe;
use crate::support::memory::Memory;
use crate::support::process::Process;

pub(crate) const MIB: usize = 1 << 20;

/// What the daemon is started with; the names below are those of the settings.
pub(crate) const MESSAGE_BYTES_MAX: usize = 32 * MIB;
pub(crate) const BODY_BYTES_MAX: usize = 64 * MIB;
const REQUESTS_MAX: usize = 256;
const STREAMS_MAX: usize = 16;
const WATCHES_MAX: usize = 4;
const CONNECTIONS_MAX: usize = 600;
const THREADS: usize = 2;
/// So short that a test sees their end.
const SECONDS: &str = "connection_opening_max_s = 2.0\nhttp_idle_max_s = 3.0\ngrpc_idle_max_s = 5.0\n\
                       body_silence_max_s = 2.0\n";

/// What a connection may hold besides bodies: what was read and not yet understood, of HTTP/1 or a frame of HTTP/2, and
/// its own state.
const CONNECTION_BYTES_MAX: usize = 128 << 10;

/// What a stream may have sent ahead of what is read from it.
const STREAM_BYTES_MAX: usize = STREAM_WINDOW_BYTES as usize;

/// Compressed messages that the daemon reads at once.
const INFLATING_MAX: usize = 2;

/// How long an attack goes on that does not end by itself.
pub(crate) const ATTACK: Duration = Duration::from_secs(2);

/// Attacks that want whole cores go on alone; those that hold things and wait, beside each other.
static GROUND: RwLock<()> = RwLock::const_new(());

/// Where an attack goes on.
#[expect(dead_code, reason = "held until the attack is over")]
enum Ground {
    Shared(RwLockReadGuard<'static, ()>),
    Alone(RwLockWriteGuard<'static, ()>),
}

/// A daemon in a process of its own, honest clients and a prober beside it.
pub(crate) struct Siege {
    name: &'static str,
    process: Process,
    probe: Probe,
    honest: Honest,
    bound: usize,
    _data: TempDir,
    _ground: Ground,
}

impl Siege {
    /// A daemon that has served honest clients for a moment: what it holds then is what it needs anyway.
    pub(crate) async fn begin(name: &'static str) -> Self {
        Self::begin_within(name, "", under_attack()).await
    }

    /// [`Siege::begin`] for an attack that wants whole cores.
    pub(crate) async fn begin_alone(name: &'static str) -> Self {
        let ground = Ground::Alone(GROUND.write().await);
        Self::begin_on(ground, name, "", under_attack()).await
    }

    /// [`Siege::begin`] with more limits, for an attack that may take no more than `bytes` of memory.
    pub(crate) async fn begin_within(name: &'static str, limits: &str, bytes: usize) -> Self {
        let ground = Ground::Shared(GROUND.read().await);
        Self::begin_on(ground, name, limits, bytes).await
    }

    async fn begin_on(ground: Ground, name: &'static str, limits: &str, bytes: usize) -> Self {
        let data = tempfile::tempdir().unwrap();
        let settings = data.path().join("mrol.toml");
        std::fs::write(&settings, self::settings() + limits).unwrap();
        let folder = data.path().join("maps");
        let process = Process::start(folder.to_str().unwrap(), &["--config", settings.to_str().unwrap()]);
        let mut honest = Honest::begin(&process.http, &process.grpc).await;
        honest.wait_for_answers(50).await;
        let memory = Memory::of(process.id());
        let bound = memory.resident() + bytes;
        memory.forget_peak();
        let probe = Probe::begin(address(&process.http));
        Self { name, process, probe, honest, bound, _data: data, _ground: ground }
    }

    pub(crate) fn http(&self) -> SocketAddr {
        address(&self.process.http)
    }

    pub(crate) fn grpc(&self) -> SocketAddr {
        address(&self.process.grpc)
    }

    /// The attack is over: says what was seen, and that it was withstood.
    pub(crate) async fn end(mut self) {
        // Who was kept from being served would be so still.
        self.honest.wait_for_answers(20).await;
        let honest = self.honest.end();
        let probe = self.probe.end();
        let peak = Memory::of(self.process.id()).peak();
        println!(
            "{}: /livez {probe}, memory {} MiB of {} MiB, honest requests {} served, {} of them after another try",
            self.name,
            peak / MIB,
            self.bound / MIB,
            honest.served,
            honest.tried_again
        );
        probe.assert_alive();
        assert!(peak <= self.bound, "{} bytes were resident, {} is the bound", peak, self.bound);
        assert_eq!(self.process.stop(), Some(0));
    }
}

fn settings() -> String {
    format!(
        "[threads]\nquery = {THREADS}\nmapping = {THREADS}\n\n[limits]\nmessage_bytes_max = {MESSAGE_BYTES_MAX}\n\
         body_bytes_max = {BODY_BYTES_MAX}\nrequests_max = {REQUESTS_MAX}\nstreams_max = {STREAMS_MAX}\n\
         watches_max = {WATCHES_MAX}\n\
         connections_max = {CONNECTIONS_MAX}\n{SECONDS}"
    )
}

/// What clients may make the daemon hold, by its limits: bodies, connections of both protocols, streams, and a message
/// in the hands of each thread of both pools and four of each that inflates one, whose room doubles and is given back
/// after a moment.
fn under_attack() -> usize {
    BODY_BYTES_MAX
        + 2 * CONNECTIONS_MAX * CONNECTION_BYTES_MAX
        + STREAMS_MAX * STREAM_BYTES_MAX
        + (4 * INFLATING_MAX + 2 * THREADS) * MESSAGE_BYTES_MAX
}

fn address(url: &str) -> SocketAddr {
    url.strip_prefix("http://").unwrap().parse().unwrap()
}
