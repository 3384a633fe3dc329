//! Asking another node as its client.

use std::collections::BTreeMap;
use std::sync::Arc;

use tokio_stream::StreamExt;

use super::failure::{Asked, error_of, no_address, not_opened};
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

/// Takes the calls of a node's callers on to other nodes. It holds one connection a node, made when it is first needed
/// and again once it is lost, and sends every call once.
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
        let client = self.client(call).await?.with_timeout(self.settings.call_timeout);
        send(client).await.map_err(|error| error_of(&call.to, asked, error))
    }

    /// A client of the node that is asked, for the caller.
    async fn client(&self, call: &ForwardedCall) -> Result<Client, ServiceError> {
        let peer = self.peers.lock().get(&call.to).cloned();
        let peer = peer.ok_or_else(|| no_address(&call.to))?;
        let ForwarderSettings { node, connect_timeout, .. } = &self.settings;
        let client = peer.client(&self.credentials, node, *connect_timeout).await;
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
            let client = self.client(call).await?;
            // The watch itself has no end; its beginning has.
            let open = client.watch_events(&call.map, query);
            let opened = tokio::time::timeout(self.settings.call_timeout, open).await;
            let node = call.to.clone();
            let failure = move |error| error_of(&node, Asked::Question, error);
            let messages = opened.map_err(|_| not_opened(&call.to))?.map_err(&failure)?;
            let events: ForwardedEvents = Box::pin(messages.map(move |message| message.map_err(&failure)));
            Ok(events)
        })
    }

    fn sightings<'a>(&'a self, call: &'a ForwardedCall) -> Later<'a, Result<Vec<Sighting>, ServiceError>> {
        Box::pin(self.ask(call, Asked::Question, async move |to| Ok(to.map_info(&call.map).await?.sightings)))
    }
}
