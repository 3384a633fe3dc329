//! The servers that a client may ask, and the connections to them.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tonic::transport::Channel;

use super::addresses::addresses;
use super::connection::{Address, Connection};
use super::credentials::Credentials;
use super::error::ClientError;

/// How long one of several addresses may take to answer a connection before the next is tried.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);

/// How long it may take at least, where the call has hardly any time left.
const CONNECT_TIMEOUT_MIN: Duration = Duration::from_millis(1);

/// One server, or several that serve the same maps.
#[derive(Debug, Clone)]
pub(super) enum Servers {
    /// The connection comes back by itself, and nothing is asked elsewhere.
    One(Connection),
    /// One of them is in use.
    Several(Arc<Several>),
}

impl Servers {
    /// Connects to the address that a text names, or to the first of several that answers.
    ///
    /// # Errors
    /// When an address is not valid, no server answers, or the two do not trust each other.
    pub(super) async fn connect(text: &str, credentials: &Credentials) -> Result<Self, ClientError> {
        let addresses = addresses(text);
        if let [only] = addresses[..] {
            return Ok(Self::One(Connection::open(only, credentials).await?));
        }
        // A server that is stopped, or cut off, is left like one that is gone.
        let parse = |url: &str| Address::parse(url, credentials).map(Address::with_keepalive);
        let addresses: Vec<Address> = addresses.into_iter().map(parse).collect::<Result<_, _>>()?;
        let used = Mutex::new(Used { connections: vec![None; addresses.len()], current: 0 });
        let several = Several {
            addresses,
            credentials: credentials.clone(),
            used,
            connecting: tokio::sync::Mutex::default(),
        };
        let mut tried = Tried::default();
        match several.connection(&mut tried, None).await {
            Some(_) => Ok(Self::Several(Arc::new(several))),
            None => Err(several.failure(tried)),
        }
    }

    /// The channel to the server in use.
    pub(super) fn channel(&self) -> Channel {
        match self {
            Self::One(connection) => connection.channel(),
            Self::Several(several) => several.channel(),
        }
    }
}

/// Several servers: calls go to one of them until it is gone, then to the next.
#[derive(Debug)]
pub(super) struct Several {
    addresses: Vec<Address>,
    credentials: Credentials,
    used: Mutex<Used>,
    /// Held while a connection is made: calls that wait for one use what the first of them has made.
    connecting: tokio::sync::Mutex<()>,
}

#[derive(Debug)]
struct Used {
    /// The connections that were made, by the places of their addresses.
    connections: Vec<Option<Connection>>,
    /// The place of the server in use.
    current: usize,
}

impl Used {
    /// Drops connections to servers that are gone.
    fn forget_gone(&mut self) {
        let is_gone = |connection: &Option<Connection>| connection.as_ref().is_some_and(Connection::is_gone);
        while let Some(place) = self.connections.iter().position(is_gone) {
            self.leave(place);
        }
    }

    /// Goes on at the next server where the one at `place` is in use.
    fn leave(&mut self, place: usize) {
        self.connections[place] = None;
        if self.current == place {
            self.current = (place + 1) % self.connections.len();
        }
    }
}

/// What one call has tried.
#[derive(Debug, Default)]
pub(super) struct Tried {
    /// Places that it does not try again.
    places: BTreeSet<usize>,
    /// How often the call was sent.
    sent: usize,
    failures: Vec<ClientError>,
}

impl Tried {
    /// Notes why an attempt failed.
    pub(super) fn note(&mut self, error: ClientError) {
        self.failures.push(error);
    }

    /// Does not try the server at `place` again.
    pub(super) fn exclude(&mut self, place: usize) {
        self.places.insert(place);
    }
}

impl Several {
    /// A connection to the first server, from the one in use on, that the call has not tried; none where there is no
    /// other, or where the call has ended at `until`. A connection that was lost is made anew last.
    pub(super) async fn connection(
        &self,
        tried: &mut Tried,
        until: Option<Instant>,
    ) -> Option<(usize, Connection)> {
        if tried.sent >= 2 * self.addresses.len() || until.is_some_and(|until| until <= Instant::now()) {
            return None;
        }
        tried.sent += 1;
        if let (place, Some(connection)) = self.next(tried)? {
            return Some((place, connection));
        }
        let turn = self.connecting.lock();
        let _turn = match until {
            Some(until) => tokio::time::timeout_at(until.into(), turn).await.ok()?,
            None => turn.await,
        };
        loop {
            let (place, kept) = self.next(tried)?;
            if let Some(connection) = kept {
                return Some((place, connection));
            }
            if let Some(connection) = self.try_place(place, tried, until).await {
                self.used.lock().connections[place] = Some(connection.clone());
                return Some((place, connection));
            }
        }
    }

    /// A connection of its own to the first server, from the one in use on, that takes one: for a stream of requests,
    /// which cannot be sent a second time.
    ///
    /// # Errors
    /// When none does.
    pub(super) async fn own_connection(&self) -> Result<Connection, ClientError> {
        let mut tried = Tried::default();
        while let Some((place, _)) = self.next(&tried) {
            if let Some(connection) = self.try_place(place, &mut tried, None).await {
                return Ok(connection);
            }
        }
        Err(self.failure(tried))
    }

    /// The next place that was not tried, and the connection that there is to it.
    fn next(&self, tried: &Tried) -> Option<(usize, Option<Connection>)> {
        let mut used = self.used.lock();
        used.forget_gone();
        let count = used.connections.len();
        let mut places = (0..count).map(|step| (used.current + step) % count);
        let place = places.find(|place| !tried.places.contains(place))?;
        Some((place, used.connections[place].clone()))
    }

    /// Connects to a server, within its share of the time that is left; notes why it failed.
    async fn try_place(&self, place: usize, tried: &mut Tried, until: Option<Instant>) -> Option<Connection> {
        let others = self.addresses.len() - tried.places.len();
        tried.exclude(place);
        let left = until.map(|until| until.saturating_duration_since(Instant::now()));
        let share = left.and_then(|left| left.checked_div(u32::try_from(others).ok()?));
        let timeout =
            share.map_or(CONNECT_TIMEOUT, |share| share.clamp(CONNECT_TIMEOUT_MIN, CONNECT_TIMEOUT));
        match self.addresses[place].connect(&self.credentials, timeout).await {
            Ok(connection) => Some(connection.replaceable()),
            Err(error) => {
                self.used.lock().leave(place);
                tried.note(error);
                None
            }
        }
    }

    /// The channel to the server in use; where there is none now, one that connects when it is used.
    fn channel(&self) -> Channel {
        let used = self.used.lock();
        let kept = used.connections[used.current].as_ref().map(Connection::channel);
        kept.unwrap_or_else(|| self.addresses[used.current].lazy_channel())
    }

    /// The error of a call that no server has answered: the loss of a connection over which it was sent; or else a
    /// refusal; or else all servers, of which none was there.
    pub(super) fn failure(&self, tried: Tried) -> ClientError {
        let Tried { mut failures, .. } = tried;
        let was_sent = |error: &ClientError| matches!(error, ClientError::Lost { .. });
        let is_other = |error: &ClientError| !matches!(error, ClientError::Unreachable { .. });
        if let Some(first) = failures.iter().position(was_sent).or_else(|| failures.iter().position(is_other))
        {
            return failures.swap_remove(first);
        }
        let mut causes: Vec<String> = Vec::new();
        for failure in failures {
            match failure {
                ClientError::Unreachable { cause, .. } if !causes.contains(&cause) => causes.push(cause),
                _ => {}
            }
        }
        let urls: Vec<&str> = self.addresses.iter().map(|address| &*address.url).collect();
        let cause = if causes.is_empty() { "no answer in time".to_owned() } else { causes.join("; ") };
        ClientError::Unreachable { url: urls.join(", "), cause }
    }
}
