//! Calls to another node, as its client.

use std::collections::BTreeMap;
use std::sync::Arc;

use tokio_stream::StreamExt;

use super::failure::{Asked, error_of, no_address, no_place, not_opened};
use super::line::Line;
use super::peer::Peer;
use super::settings::{ForwarderError, ForwarderSettings};
use mrol_client::{Client, ClientError, Credentials};
use mrol_map::mapping::Sighting;
use mrol_map::sync::{Mutex, Rank};
use mrol_service::replication::NodeName;
use mrol_service::{
    DeleteKeepOut, Deletion, DeletionAnswer, EventsQuery, Forward, ForwardedCall, ForwardedEvents,
    KeepOutAnswer, Later, PutKeepOut, ScanAnswer, ScanEvent, ScanRequest, ServiceError, Undo, UndoAnswer,
};

/// Takes the calls of a node's callers on to other nodes, and sends every call once. It holds a connection a node for
/// calls, and others for watches, which last.
#[derive(Debug)]
pub struct Forwarder {
    settings: ForwarderSettings,
    credentials: Credentials,
    peers: Mutex<BTreeMap<NodeName, Arc<Peer>>>,
}

impl Forwarder {
    /// A forwarder that knows no other node yet. Reads the files of the settings: not for an async thread.
    ///
    /// # Errors
    /// When a file cannot be read or holds something else, or the secret has characters that no secret has.
    pub fn new(settings: ForwarderSettings) -> Result<Self, ForwarderError> {
        let credentials = settings.credentials()?;
        Ok(Self { settings, credentials, peers: Mutex::new(Rank::Brief, BTreeMap::new()) })
    }

    /// From now on these are the other nodes, with the addresses of their gRPC listeners: `http://HOST:PORT` or
    /// `https://HOST:PORT`. Connections to nodes whose address stays are kept.
    pub fn set_addresses(&self, addresses: BTreeMap<NodeName, String>) {
        let mut peers = self.peers.lock();
        let mut former = std::mem::take(&mut *peers);
        for (node, address) in addresses {
            let same = former.remove(&node).filter(|peer| peer.address == address);
            peers.insert(node, same.unwrap_or_else(|| Arc::new(Peer::at(address))));
        }
        drop(peers);
    }

    /// Asks a node by `send`, for the caller of `call`.
    async fn ask<A, Fut>(
        &self,
        call: &ForwardedCall,
        asked: Asked,
        send: impl FnOnce(Client) -> Fut,
    ) -> Result<A, ServiceError>
    where
        Fut: Future<Output = Result<A, ClientError>>,
    {
        let peer = self.peer(call)?;
        let place = peer.calls.place(self.settings.place_timeout).await;
        let _place = place.ok_or_else(|| no_place(&call.to))?;
        let client = self.client(call, &peer, &peer.calls).await?.with_timeout(self.settings.call_timeout);
        send(client).await.map_err(|error| error_of(&call.to, asked, error))
    }

    /// The node that is asked.
    fn peer(&self, call: &ForwardedCall) -> Result<Arc<Peer>, ServiceError> {
        self.peers.lock().get(&call.to).cloned().ok_or_else(|| no_address(&call.to))
    }

    /// A client of the node that is asked, by a connection to it, for the caller.
    async fn client(&self, call: &ForwardedCall, peer: &Peer, line: &Line) -> Result<Client, ServiceError> {
        let ForwarderSettings { node, connect_timeout, .. } = &self.settings;
        let client = line.client(&peer.address, &self.credentials, node, *connect_timeout).await;
        let client = client.map_err(|error| error_of(&call.to, Asked::Question, error))?;
        Ok(client.on_behalf_of(call.caller.as_ref()))
    }
}

impl Forward for Forwarder {
    fn insert_scan<'a>(
        &'a self,
        call: &'a ForwardedCall,
        scan: ScanRequest,
    ) -> Later<'a, Result<ScanAnswer, ServiceError>> {
        Box::pin(self.ask(call, Asked::Change, async move |to| to.insert_scan(&call.map, scan).await))
    }

    fn delete_voxels<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: Deletion,
    ) -> Later<'a, Result<DeletionAnswer, ServiceError>> {
        Box::pin(self.ask(call, Asked::Change, async move |to| to.delete_voxels(&call.map, deletion).await))
    }

    fn undo<'a>(
        &'a self,
        call: &'a ForwardedCall,
        undo: Undo,
    ) -> Later<'a, Result<UndoAnswer, ServiceError>> {
        Box::pin(self.ask(call, Asked::Change, async move |to| to.undo(&call.map, undo).await))
    }

    fn put_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        put: PutKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>> {
        Box::pin(self.ask(call, Asked::Change, async move |to| to.put_keep_out(&call.map, put).await))
    }

    fn delete_keep_out<'a>(
        &'a self,
        call: &'a ForwardedCall,
        deletion: DeleteKeepOut,
    ) -> Later<'a, Result<KeepOutAnswer, ServiceError>> {
        Box::pin(self.ask(call, Asked::Change, async move |to| to.delete_keep_out(&call.map, deletion).await))
    }

    fn list_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<Vec<Arc<ScanEvent>>, ServiceError>> {
        Box::pin(self.ask(call, Asked::Question, async move |to| {
            let events = to.list_events(&call.map, query).await?;
            Ok(events.into_iter().map(Arc::new).collect())
        }))
    }

    fn watch_events<'a>(
        &'a self,
        call: &'a ForwardedCall,
        query: EventsQuery,
    ) -> Later<'a, Result<ForwardedEvents, ServiceError>> {
        Box::pin(async move {
            let peer = self.peer(call)?;
            let (line, place) = peer.for_watch().ok_or_else(|| no_place(&call.to))?;
            let client = self.client(call, &peer, &line).await?;
            // The watch itself has no end; its beginning has.
            let open = client.watch_events(&call.map, query);
            let opened = tokio::time::timeout(self.settings.call_timeout, open).await;
            let node = call.to.clone();
            let failure = move |error| error_of(&node, Asked::Question, error);
            let messages = opened.map_err(|_| not_opened(&call.to))?.map_err(&failure)?;
            let told = move |message: Result<_, _>| {
                let _held = (&line, &place);
                message.map_err(&failure)
            };
            let events: ForwardedEvents = Box::pin(messages.map(told));
            Ok(events)
        })
    }

    fn sightings<'a>(&'a self, call: &'a ForwardedCall) -> Later<'a, Result<Vec<Sighting>, ServiceError>> {
        Box::pin(self.ask(call, Asked::Question, async move |to| Ok(to.map_info(&call.map).await?.sightings)))
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use tokio::io::AsyncReadExt;
    use tokio::net::{TcpListener, TcpStream};

    use super::super::line::CALLS_MAX;
    use super::*;
    use mrol_map::map::MapName;
    use mrol_service::{Reason, UndoTarget};

    const CONNECT_TIMEOUT: Duration = Duration::from_millis(300);

    fn node(name: &str) -> NodeName {
        NodeName::new(name).unwrap()
    }

    /// A forwarder that knows node `b` at this address.
    fn forwarder(address: &str) -> Forwarder {
        let forwarder = Forwarder::new(ForwarderSettings {
            secret: Some("mrol_1".to_owned()),
            connect_timeout: CONNECT_TIMEOUT,
            call_timeout: Duration::from_millis(500),
            place_timeout: Duration::from_millis(100),
            ..ForwarderSettings::new(node("a"))
        });
        let forwarder = forwarder.unwrap();
        forwarder.set_addresses([(node("b"), format!("http://{address}"))].into());
        forwarder
    }

    fn call_to(name: &str) -> ForwardedCall {
        ForwardedCall { to: node(name), caller: None, map: MapName::new("hall").unwrap() }
    }

    async fn undo(forwarder: &Forwarder, to: &str) -> ServiceError {
        let undo = Undo { target: UndoTarget::Revision(1), request_id: None };
        forwarder.undo(&call_to(to), undo).await.unwrap_err()
    }

    #[tokio::test]
    async fn a_node_that_is_not_there_was_sent_nothing() {
        let free = TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
        let forwarder = forwarder(&free.to_string());
        let refused = undo(&forwarder, "b").await;
        assert_eq!(refused.reason, Reason::NoQuorum);
        assert!(refused.message.starts_with("node b does not answer ("), "{refused}");
        let unknown = undo(&forwarder, "c").await;
        assert_eq!(unknown.reason, Reason::NoQuorum);
        assert!(unknown.message.contains("its address is not known here"), "{unknown}");
    }

    #[tokio::test]
    async fn of_a_change_that_is_not_answered_nobody_knows_the_outcome_and_of_a_question_it_does_not_matter()
    {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let forwarder = forwarder(&listener.local_addr().unwrap().to_string());
        // Whoever connects is heard and not answered.
        let hears = tokio::spawn(async move {
            let mut heard = Vec::new();
            while let Ok((connection, _)) = listener.accept().await {
                heard.push(connection);
            }
        });
        assert_eq!(undo(&forwarder, "b").await.reason, Reason::OutcomeUnknown);
        let query = EventsQuery::default();
        let listed = forwarder.list_events(&call_to("b"), query.clone()).await.unwrap_err();
        assert_eq!(listed.reason, Reason::NoQuorum);
        let watched = forwarder.watch_events(&call_to("b"), query).await.map(drop).unwrap_err();
        assert_eq!(watched.reason, Reason::NoQuorum);
        hears.abort();
    }

    #[tokio::test]
    async fn a_change_that_has_no_place_on_the_connection_was_not_sent() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let forwarder = Arc::new(forwarder(&listener.local_addr().unwrap().to_string()));
        let hears = tokio::spawn(async move {
            let mut heard = Vec::new();
            while let Ok((connection, _)) = listener.accept().await {
                heard.push(connection);
            }
        });
        let mut calls = tokio::task::JoinSet::new();
        for _ in 0..=CALLS_MAX {
            let forwarder = Arc::clone(&forwarder);
            calls.spawn(async move { undo(&forwarder, "b").await });
        }
        let told = calls.join_all().await;
        let not_sent = told.iter().filter(|error| error.reason == Reason::NoQuorum).count();
        assert_eq!(not_sent, 1, "{told:?}");
        hears.abort();
    }

    #[tokio::test]
    async fn a_connection_that_is_lost_after_a_change_was_sent_is_made_again_for_the_next() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let forwarder = forwarder(&listener.local_addr().unwrap().to_string());
        let hangs_up = async || -> TcpStream {
            let (mut connection, _) = listener.accept().await.unwrap();
            let mut heard = 0;
            // The preface, the settings, the head and the message.
            while heard < 200 {
                heard += connection.read(&mut [0; 1024]).await.unwrap();
            }
            connection
        };
        for _ in 0..2 {
            let (failed, _) = tokio::join!(undo(&forwarder, "b"), hangs_up());
            assert_eq!(failed.reason, Reason::OutcomeUnknown, "{failed}");
        }
    }

    #[tokio::test]
    async fn many_callers_wait_for_a_silent_node_no_longer_than_one() {
        // Once the queue of a listener that accepts nothing is full, nobody answers a connection.
        let socket = tokio::net::TcpSocket::new_v4().unwrap();
        socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
        let listener = socket.listen(1).unwrap();
        let address = listener.local_addr().unwrap();
        let mut waiting = Vec::new();
        for _ in 0..4 {
            waiting.push(tokio::time::timeout(Duration::from_millis(200), TcpStream::connect(address)).await);
        }
        let forwarder = Arc::new(forwarder(&address.to_string()));
        let begin = Instant::now();
        let mut calls = tokio::task::JoinSet::new();
        for _ in 0..20 {
            let forwarder = Arc::clone(&forwarder);
            calls.spawn(async move { undo(&forwarder, "b").await });
        }
        let told = calls.join_all().await;
        assert!(told.iter().all(|error| error.reason == Reason::NoQuorum), "{told:?}");
        assert!(begin.elapsed() < 3 * CONNECT_TIMEOUT, "{:?}", begin.elapsed());
    }

    #[test]
    fn a_connection_stays_where_the_address_does() {
        let forwarder = forwarder("127.0.0.1:1");
        let peer = |name: &str| forwarder.peers.lock().get(&node(name)).cloned();
        let first = peer("b").unwrap();
        let two = |b: &str| [(node("b"), b.to_owned()), (node("c"), "http://127.0.0.1:2".to_owned())].into();
        forwarder.set_addresses(two("http://127.0.0.1:1"));
        assert!(Arc::ptr_eq(&first, &peer("b").unwrap()) && peer("c").is_some());
        forwarder.set_addresses(two("http://127.0.0.1:3"));
        assert!(!Arc::ptr_eq(&first, &peer("b").unwrap()));
        forwarder.set_addresses(BTreeMap::new());
        assert!(peer("b").is_none());
    }

    #[test]
    fn the_secret_is_not_shown() {
        let shown = format!("{:?}", forwarder("127.0.0.1:1"));
        assert!(!shown.contains("mrol_1"), "{shown}");
        let none = ForwarderSettings { secret: Some("a b".to_owned()), ..ForwarderSettings::new(node("a")) };
        let refused = Forwarder::new(none).unwrap_err().to_string();
        assert!(!refused.contains("a b"), "{refused}");
    }
}
